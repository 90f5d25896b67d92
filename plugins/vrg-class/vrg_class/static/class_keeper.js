// Keeps what is typed: in the browser at once, and on the computer of the class when typing stops.
import { ask } from "./class_server.js";
import { drop, isLacking, keep, kept, names } from "./storage.js";
import { words } from "./day_words.js";

const AFTER = 1000, AGAIN = 3000, MOST = 100;
/** Pages of a browser keep what is typed apart from each other. */
const page = Math.random().toString(36).slice(2);
const places = (id) => `vrg-class-code-${id}:`; // ids have hyphens, and one may begin as another does

/**
 * What earlier pages of a student have left unsaved goes to the class. Returns the last one that is not made from the
 * newest code, {here, there}; or else whether something was `sent`.
 */
export async function sendLeft(id, token) {
  let found = { sent: false };
  for (const place of names(places(id)).filter((name) => name !== places(id) + page)) {
    const left = JSON.parse(kept(place));
    try {
      await ask("save", token, left);
      found.sent = true;
    } catch (refusal) {
      if ([0, 401].includes(refusal.status)) throw refusal;
      if (refusal.why !== "stale") continue; // there is no room for it now: it stays here
      found = { sent: true, here: left.code, there: refusal.answer };
    }
    drop(place);
  }
  return found;
}

export class Keeper {
  /**
   * `code()` gives the code of the student with this id and token, which was made from what the class has as `base`;
   * `tell(words)` is called with what has become of it, `onStale(here, there)` where the class has newer code.
   */
  constructor(id, token, base, code, tell, onStale) {
    Object.assign(this, { id, token, base, code, tell, onStale, place: places(id) + page, timer: 0, unsaved: false, asks: false });
    /** What this page has had since it last was asked: code of its own is nothing newer. */
    this.own = new Set();
    this.turn = Promise.resolve();
    this.apart = false;
  }

  /** Take in that the code has been changed; `apart` has what it replaces kept as a version. */
  changed(apart = false) {
    this.unsaved = true;
    this.apart ||= apart;
    this.note();
    this.tell(words("student.saving"));
    this.later(AFTER);
  }

  /** Note what stands here, in the browser and as code of this page. */
  note() {
    const code = this.code();
    this.own.add(code);
    if (this.own.size > MOST) this.own.delete(this.own.values().next().value);
    keep(this.place, JSON.stringify({ code, base: this.base, apart: this.apart }));
  }

  later(pause) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.save(), pause);
  }

  /** Take in that the class has this code now, as this revision. */
  saved(code, revision) {
    this.base = revision;
    this.apart = false;
    if (code !== this.code()) {
      if (this.unsaved) this.note();
      return;
    }
    clearTimeout(this.timer);
    this.unsaved = false;
    drop(this.place);
    this.tell(words("student.saved"));
  }

  /** Save nothing more by itself. */
  stop() {
    clearTimeout(this.timer);
  }

  /** Save what is not saved, now; `leaving` lets it go on when the page is gone. */
  async save(leaving = false) {
    if (!this.unsaved || this.asks) return;
    try {
      await this.send("save", {}, leaving);
    } catch (refusal) {
      if (refusal.why === "stale") return;
      this.tell(refusal.status ? refusal.message : words(isLacking() ? "student.unsaved" : "student.kept"));
      this.later(AGAIN);
    }
  }

  /** Ask for something with the code as it stands when it is its turn, and which is saved by that. Throws a Refusal. */
  send(path, body = {}, leaving = false) {
    const sending = leaving ? this.ask(path, body, true) : this.turn.then(() => this.ask(path, body));
    this.turn = sending.catch(() => {});
    return sending;
  }

  async ask(path, body, leaving = false) {
    const code = this.code();
    this.own.add(code);
    try {
      const answer = await ask(path, this.token, { code, base: this.base, apart: this.apart, ...body }, { keepalive: leaving });
      this.saved(code, answer.revision);
      return answer;
    } catch (refusal) {
      if (refusal.why !== "stale") throw refusal;
      if (this.own.has(refusal.answer.code)) { // another page has saved what was left here
        this.base = refusal.answer.revision;
        return this.ask(path, body, leaving);
      }
      this.isStale(code, refusal.answer);
      throw refusal;
    }
  }

  /** Another page of this student has saved; true if this one is to show it, too. */
  follows(code, revision) {
    if (this.unsaved || this.asks || this.base === revision || this.own.has(code)) return false;
    this.own.clear();
    return true;
  }

  /** The class has newer code than that from which this was made, and has kept both: the student is asked. */
  isStale(here, there) {
    this.asks = true;
    this.tell("");
    this.onStale(here, there);
  }

  /** Take in what the student has chosen; the code of the class is `revision`. */
  chosen(revision) {
    this.asks = false;
    this.base = revision;
    this.own.clear();
  }
}
