// Keeps what is typed: in the browser at once, and on the computer of the class when typing stops.
import { ask } from "./class_server.js";
import { drop, isLacking, keep, kept, names, TAB } from "./day_storage.js";
import { words } from "./day_words.js";

const AFTER = 1000, AGAIN = 3000, TAB_NAME = "vrg-class-tab";
/** Two tabs of a browser keep what is typed apart from each other; a reload stays the same tab. */
const tab = kept(TAB_NAME, TAB) ?? Math.random().toString(36).slice(2);
keep(TAB_NAME, tab, TAB);

/** What earlier pages of a student have left unsaved goes to the class. Returns the last one that is not the newest code. */
export async function sendLeft(token) {
  let stale = null;
  for (const place of names(`vrg-class-code-${token}-`)) {
    const { code, base } = JSON.parse(kept(place));
    try {
      await ask("save", token, { code, base });
    } catch (refusal) {
      if (refusal.why !== "stale") throw refusal;
      stale = { here: code, there: refusal.answer };
    }
    drop(place);
  }
  return stale;
}

export class Keeper {
  /**
   * `code()` gives the code of the student with this token, which was made from what the class has as `base`;
   * `tell(words)` is called with what has become of it, `onStale(here, there)` where the class has newer code.
   */
  constructor(token, base, code, tell, onStale) {
    Object.assign(this, { token, base, code, tell, onStale, place: `vrg-class-code-${token}-${tab}`, timer: 0, unsaved: false, asks: false });
  }

  /** Take in that the code has been changed. */
  changed() {
    this.unsaved = true;
    keep(this.place, JSON.stringify({ code: this.code(), base: this.base }));
    this.tell(words("student.saving"));
    this.later(AFTER);
  }

  later(pause) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.save(), pause);
  }

  /** Take in that the class has this code now, as this revision. */
  saved(code, revision) {
    this.base = revision;
    if (code !== this.code()) {
      if (this.unsaved) keep(this.place, JSON.stringify({ code: this.code(), base: revision }));
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

  /** Ask for something with the code as it stands here, which is saved by that. Throws a Refusal. */
  async send(path, body = {}, leaving = false) {
    const code = this.code();
    try {
      const answer = await ask(path, this.token, { code, base: this.base, ...body }, leaving);
      this.saved(code, answer.revision);
      return answer;
    } catch (refusal) {
      if (refusal.why === "stale") this.isStale(code, refusal.answer);
      throw refusal;
    }
  }

  /** The class has newer code than that from which this was made, and has kept both: the student is asked. */
  isStale(here, there) {
    this.asks = true;
    this.tell(words("student.unsaved"));
    this.onStale(here, there);
  }

  /** Take in what the student has chosen; the code of the class is `revision`. */
  chosen(revision) {
    this.asks = false;
    this.base = revision;
  }
}
