// Where the robots are between the frames that the server sends. Pure: it is told the time.

/** s that the picture is behind, so that there is a frame on either side of it. */
export const DELAY = 0.1;
/** m; a body that moved further between two frames was placed there, it did not drive. */
export const JUMP = 1.0;
export const TRAIL_SECONDS = 6.0;
const TRAIL_STEP = 0.2;
const KEPT = 40;

export class Motion {
  constructor() {
    this.reset();
  }

  reset() {
    this.frames = [];
    this.trails = [];
    this.offset = null;
  }

  /** Take in a frame that arrived at `now`, s of this machine's clock. */
  take(frame, now) {
    const before = this.latest;
    if (before && (frame.time < before.time || frame.bodies.length !== before.bodies.length)) this.reset();
    if (this.latest?.time === frame.time) {
      this.frames[this.frames.length - 1] = frame;
      return;
    }
    const offset = now - frame.time / (frame.rate || 1);
    // The clocks run alike but for what the network adds, which is smoothed away.
    if (this.offset === null || Math.abs(offset - this.offset) > 0.5) this.offset = offset;
    else this.offset += 0.1 * (offset - this.offset);
    this.frames.push(frame);
    if (this.frames.length > KEPT) this.frames.shift();
    this.leaveTrails(frame);
  }

  leaveTrails(frame) {
    frame.bodies.forEach(([x, y], index) => {
      const trail = (this.trails[index] ??= { points: [], last: [x, y] });
      if (Math.hypot(x - trail.last[0], y - trail.last[1]) > JUMP) trail.points = [];
      trail.last = [x, y];
      const points = trail.points;
      if (!points.length || frame.time - points[points.length - 1][2] >= TRAIL_STEP - 1e-9) points.push([x, y, frame.time]);
      while (points.length && frame.time - points[0][2] > TRAIL_SECONDS) points.shift();
    });
  }

  get latest() {
    return this.frames[this.frames.length - 1] ?? null;
  }

  /** The bodies, [x, y, heading] each, as they are to be shown at `now`, s. */
  at(now) {
    const frames = this.frames;
    if (!frames.length) return [];
    const newest = frames[frames.length - 1];
    const time = (now - this.offset - DELAY) * (newest.rate || 1);
    let next = frames.findIndex((frame) => frame.time > time);
    if (next < 0) return newest.bodies;
    if (next === 0) return frames[0].bodies;
    const before = frames[next - 1], after = frames[next];
    const share = (time - before.time) / (after.time - before.time);
    return before.bodies.map((start, index) => between(start, after.bodies[index], share));
  }
}

/** The pose on the way from one to another; a body that was placed jumps. */
export function between(start, end, share) {
  if (Math.hypot(end[0] - start[0], end[1] - start[1]) > JUMP) return start;
  const turn = Math.atan2(Math.sin(end[2] - start[2]), Math.cos(end[2] - start[2]));
  return [start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]), start[2] + share * turn];
}
