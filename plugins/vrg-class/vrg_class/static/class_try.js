// What a try has reported so far, by kind and time. Pure: it draws nothing.
import { words } from "./day_words.js";
import { newest, Recording as Shown } from "./recording.js";

/** s: the field is not known before. */
export const FIRST = 0.1;
export const seconds = (time) => `${time.toFixed(1)} s`;
/** A failure of the code, in words. */
export const fault = ({ line, text }) => words(line ? "student.errorIn" : "student.error", { line, text });

export class Recording extends Shown {
  /** A try of a step, by its name, with a version of the code. */
  constructor(step = "", version = 0) {
    super();
    Object.assign(this, { step, version, place: 0, last: 0, end: null, errors: [], marks: [] });
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
  const { goal, ended, why, most, winner, score } = end, student = (key, fields) => words(`student.${key}`, fields);
  if (goal?.reached != null) return { words: student("reached", { time: seconds(goal.reached) }), kind: "good" };
  if (errors.length) return { words: fault(errors[0]), kind: "bad", line: errors[0].line };
  if (why) return { words: student(why, { most }), kind: "bad" };
  if (ended) return { words: student("broken", { why: ended }), kind: "bad" };
  const spoiled = { call: "spoiledCall", time: "spoiledTime" }[goal?.spoiled];
  if (spoiled) return { words: student(spoiled, { rule: goal.rule?.replaceAll("_", " "), within: goal.within }), kind: "bad" };
  if (goal) return { words: student("missed"), kind: "bad" };
  const team = about?.team, points = Object.keys(score).sort((a, b) => (b === team) - (a === team)).map((name) => score[name]).join(" : ");
  const key = winner === team ? "won" : winner === "draw" ? "draw" : winner ? "lost" : "open";
  return { words: student(key, { score: points }), kind: winner === team ? "good" : "" };
}
