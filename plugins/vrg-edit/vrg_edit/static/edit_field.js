// The field of the configurator: robots are chosen, dragged and turned on it, with a pointer or with keys.
import { Field } from "./field.js";
import { Match } from "./match.js";
import { angle, place, point } from "./view.js";

/** Pixels: how near to a robot it is taken hold of, how far the ring is before it, and the radius of the ring. */
const NEAR = 14, ARM = 38, RING = 8;
const MOVE = 0.1, TURN = Math.PI / 36;

export class Plan {
  /** `onPlace(player, [x, y, heading])` is called when a robot has been moved, `onChoose(player)` when it is chosen. */
  constructor(canvas, onPlace, onChoose) {
    this.canvas = canvas;
    this.match = new Match();
    this.field = new Field(canvas, canvas.parentElement);
    this.onPlace = onPlace;
    this.onChoose = onChoose;
    this.numbers = [];
    this.bad = new Set();
    this.chosen = null;
    this.movable = false;
    /** How many moves the server has not taken in yet. */
    this.waits = 0;
    this.held = null;
    canvas.addEventListener("pointerdown", (event) => this.take(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    canvas.addEventListener("pointerup", () => this.letGo());
    canvas.addEventListener("pointercancel", () => (this.held = null));
    canvas.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
  }

  /** Show what the server tells; a robot that was moved since stays where it was moved to. */
  show(told) {
    if (this.held || this.waits) return;
    for (const part of told.picture) {
      if (part.t === "frame") this.match.motion.reset();
      this.match.take(part, 0);
    }
    this.match.motion.trails = [];
    this.numbers = told.numbers;
    this.bad = new Set(told.problems.flatMap(({ fields }) => fields).map((key) => /^players\.(\d+)/.exec(key)?.[1]).filter(Boolean).map(Number));
    this.draw();
  }

  get bodies() {
    return this.match.motion.latest?.bodies ?? [];
  }

  /** The pose of the player that is chosen, or undefined where it has none. */
  get pose() {
    return this.bodies[this.numbers.indexOf(this.chosen)];
  }

  draw() {
    const own = this.movable && this.pose ? this.match.looks.bodies[this.numbers.indexOf(this.chosen)].name : "";
    this.field.draw(this.match, 0, own);
    const { view, context: c } = this.field, { colours } = this.match;
    if (!view) return;
    c.strokeStyle = "#ff8a80";
    c.lineWidth = 3;
    this.bodies.forEach(([x, y], index) => {
      if (!this.bad.has(this.numbers[index])) return;
      c.beginPath();
      c.arc(...point(view, x, y), 20, 0, 2 * Math.PI);
      c.stroke();
    });
    if (!own) return;
    const [rx, ry] = this.ring();
    c.strokeStyle = colours.caution;
    c.fillStyle = colours.background;
    c.beginPath();
    c.moveTo(...point(view, this.pose[0], this.pose[1]));
    c.lineTo(rx, ry);
    c.stroke();
    c.beginPath();
    c.arc(rx, ry, RING, 0, 2 * Math.PI);
    c.fill();
    c.stroke();
  }

  /** Where the ring is that turns the chosen robot. */
  ring() {
    const { view } = this.field, [x, y, heading] = this.pose, [px, py] = point(view, x, y), a = angle(view, heading);
    return [px + ARM * Math.cos(a), py - ARM * Math.sin(a)];
  }

  take(event) {
    const { view } = this.field, at = [event.offsetX, event.offsetY];
    if (!view || !this.movable) return;
    const away = ([x, y]) => Math.hypot(x - at[0], y - at[1]);
    const turns = this.pose && away(this.ring()) <= RING + 8;
    if (!turns) {
      const found = this.bodies.map(([x, y], index) => [away(point(view, x, y)), index]).sort((a, b) => a[0] - b[0])[0];
      const body = found && this.match.looks.bodies[found[1]];
      if (!body || found[0] > Math.max(NEAR, (Math.hypot(...body.size) / 2) * view.scale)) return;
      this.choose(this.numbers[found[1]]);
    }
    const [x, y] = place(view, ...at);
    this.held = { turns, grip: [x - this.pose[0], y - this.pose[1]], moved: false };
    this.canvas.setPointerCapture(event.pointerId);
  }

  drag(event) {
    if (!this.held || !this.pose) return;
    const [x, y] = place(this.field.view, event.offsetX, event.offsetY), pose = this.pose;
    if (this.held.turns) pose[2] = Math.atan2(y - pose[1], x - pose[0]);
    else [pose[0], pose[1]] = [x - this.held.grip[0], y - this.held.grip[1]];
    this.held.moved = true;
    this.choose(this.chosen);
  }

  letGo() {
    if (this.held?.moved) this.place();
    this.held = null;
  }

  choose(player) {
    this.chosen = player;
    this.draw();
    this.onChoose(player);
  }

  press(event) {
    const key = event.key.toLowerCase(), step = { n: 1, p: -1 }[key];
    if (!this.movable || event.ctrlKey || event.metaKey || event.altKey || !this.numbers.length) return;
    if (step) {
      const at = this.numbers.indexOf(this.chosen);
      this.choose(this.numbers[at < 0 ? 0 : (at + step + this.numbers.length) % this.numbers.length]);
    }
    const turn = { q: TURN, e: -TURN }[key], far = event.shiftKey ? 10 * MOVE : MOVE;
    const move = { arrowup: [0, far], arrowdown: [0, -far], arrowleft: [-far, 0], arrowright: [far, 0] }[key];
    if (!this.pose || !(turn || move)) return;
    event.preventDefault();
    const [dx, dy] = place({ ...this.field.view, left: 0, top: 0, x: 0, y: 0, scale: 1 }, move?.[0] ?? 0, -(move?.[1] ?? 0));
    this.pose[0] += dx;
    this.pose[1] += dy;
    this.pose[2] += turn ?? 0;
    this.choose(this.chosen);
    this.place();
  }

  place() {
    this.waits += 1;
    this.onPlace(this.chosen, this.pose);
  }
}
