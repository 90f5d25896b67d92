// What a try has reported so far, by kind and time. Pure: it draws nothing.
import { WORDS } from "./class_words.js";
import { newest, Recording as Shown } from "./recording.js";

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
  const { goal, ended, winner, score } = end;
  if (goal?.reached != null) return { words: WORDS.reached(goal.reached), kind: "good" };
  if (errors.length) return { words: WORDS.error(errors[0]), kind: "bad", line: errors[0].line };
  if (ended) return { words: WORDS.broken(ended), kind: "bad" };
  if (goal) return { words: goal.spoiled ? WORDS.spoiled(goal.spoiled) : WORDS.missed, kind: "bad" };
  const team = about?.team, points = Object.keys(score).sort((a, b) => (b === team) - (a === team)).map((name) => score[name]).join(" : ");
  const words = winner === team ? WORDS.won : winner === "draw" ? WORDS.draw : winner ? WORDS.lost : WORDS.open;
  return { words: words(points), kind: winner === team ? "good" : "" };
}
