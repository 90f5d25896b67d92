// What a try has reported so far, by kind and time, and how it is shown at an instant. Pure: it draws nothing.
import { WORDS } from "./class_words.js";
import { DELAY, TRAIL_SECONDS } from "./motion.js";

const KINDS = ["ground", "looks", "state", "strokes"];

/** The index of the newest of a list at or before a time; -1 if there is none. */
export function newest(list, time) {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle].time <= time + 1e-6) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

export class Recording {
  /** A try of a step, by its name, with a version of the code. */
  constructor(step = "", version = 0) {
    Object.assign(this, { step, version, about: null, place: 0, last: 0, end: null, errors: [], marks: [] });
    this.lists = { frame: [], ground: [], looks: [], state: [], strokes: [] };
    this.views = new Map();
  }

  /** Take in a message of the server. */
  take(message) {
    const { t, time } = message;
    if (t === "queue") this.place = message.place;
    if (t === "about") {
      Object.assign(this, { about: message, place: 0 });
      for (const name of message.own) this.views.set(name, []);
    }
    if (t === "at") {
      this.last = time;
      for (const part of message.parts) this.lists[part.t]?.push({ time, part });
    }
    if (t === "view") this.views.get(message.player)?.push(message);
    if (t === "error") this.errors.push(message);
    if (["error", "call", "print"].includes(t) && time != null) this.marks.push({ time, kind: t });
    if (t === "end") this.end = message;
  }

  /** There is something to see. */
  get begun() {
    return this.lists.frame.length > 0;
  }

  /** What a player saw at a time; undefined before it saw anything. */
  viewAt(player, time) {
    const list = this.views.get(player) ?? [];
    return list[newest(list, time)];
  }
}

/** How a try has ended: {words, kind}, and the line of an error if one is known. */
export function outcome({ end, errors, about }) {
  const { goal, ended, winner, score } = end;
  if (goal?.reached != null) return { words: WORDS.reached(goal.reached), kind: "good" };
  if (errors.length) return { words: WORDS.error(errors[0]), kind: "bad", line: errors[0].line };
  if (ended) return { words: WORDS.broken(ended), kind: "bad" };
  if (goal) return { words: goal.spoiled ? WORDS.spoiled(goal.spoiled) : WORDS.missed, kind: "bad" };
  const team = about?.team, points = Object.keys(score).sort((a, b) => (b === team) - (a === team)).map((name) => score[name]).join(" : ");
  const words = winner === team ? WORDS.won : winner === "draw" ? WORDS.draw : winner ? WORDS.lost : WORDS.open;
  return { words: words(points), kind: winner === team ? "good" : "" };
}

/** Shows a recording at one instant after the other by feeding a `Match`, which knows no way back by itself. */
export class Projection {
  constructor(match) {
    this.match = match;
    this.forget();
  }

  forget() {
    this.match.forget();
    this.shown = {};
    this.frame = -1;
  }

  /** Show a time of the recording, s. Returns the instant with which `Field.draw` is to be called. */
  show(recording, time) {
    const { match } = this, frames = recording.lists.frame;
    for (const kind of KINDS) {
      const found = recording.lists[kind][newest(recording.lists[kind], time)]?.part;
      if (found && this.shown[kind] !== found) match.take((this.shown[kind] = found), time);
    }
    // Up to the frame behind the instant, so that there is one on either side.
    const wanted = Math.min(newest(frames, time) + 1, frames.length - 1);
    if (wanted < this.frame || wanted > this.frame + 20) {
      match.motion.reset();
      this.frame = Math.max(-1, newest(frames, time - TRAIL_SECONDS) - 1);
    }
    while (this.frame < wanted) {
      const { part } = frames[++this.frame];
      match.take({ ...part, rate: 1 }, part.time);
    }
    return time + DELAY;
  }
}
