// A recording that a page has as a whole: what was to be seen, by kind and time. Pure: it draws nothing.
import { between } from "./motion.js";

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

/** Answers as the server of a recorded match does. */
export class Recording {
  /** `about` is the answer to /match, whose marks have their calls; `parts` are {time, part}, in the order of time. */
  constructor({ about = null, parts = [] } = {}) {
    this.about = about;
    this.called = about?.marks ?? [];
    this.lists = { frame: [], ground: [], looks: [], state: [], strokes: [] };
    this.given = {};
    for (const entry of parts) this.lists[entry.part.t].push(entry);
  }

  /** The parts of the scene at a match time, s, that have changed since it was asked last. */
  at(time, rate) {
    const found = [], { frame } = this.lists, count = newest(this.called, time) + 1;
    const add = (name, key, part) => {
      if (part && this.given[name] !== key) found.push(part);
      this.given[name] = key;
    };
    for (const kind of KINDS) {
      const part = this.lists[kind][Math.max(0, newest(this.lists[kind], time))]?.part;
      add(kind, part, part);
    }
    add("calls", count, { t: "calls", calls: this.called.slice(0, count).map((mark) => mark.call) });
    const index = Math.max(0, newest(frame, time)), before = frame[index], after = frame[index + 1] ?? before;
    const share = after === before ? 0 : Math.max(0, time - before.time) / (after.time - before.time);
    const bodies = before.part.bodies.map((start, number) => between(start, after.part.bodies[number] ?? start, share));
    return [...found, { ...before.part, time, rate, bodies }];
  }
}

/** What stands in an element as the Base64 of a text of JSON that gzip has made smaller; null if there is none. */
export async function packed(element) {
  if (!element) return null;
  const bytes = Uint8Array.from(atob(element.textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).json();
}
