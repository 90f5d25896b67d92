// Keeps what is typed: in the browser at once, and on the computer of the class when typing stops.
import { ask } from "./class_server.js";
import { WORDS } from "./class_words.js";

const AFTER = 1000, AGAIN = 3000;

export class Keeper {
  /** `code()` gives the code of the student with this token; `tell(words)` is called with what has become of it. */
  constructor(token, code, tell) {
    Object.assign(this, { token, code, tell, place: `vrg-class-code-${token}`, timer: 0 });
  }

  /** What was typed here and not saved, or else what the class has. */
  newest(saved) {
    return localStorage.getItem(this.place) ?? saved;
  }

  /** Take in that the code has been changed. */
  changed() {
    localStorage.setItem(this.place, this.code());
    this.tell(WORDS.saving);
    this.later(AFTER);
  }

  later(pause) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.save(), pause);
  }

  /** Take in that the class has this code. */
  saved(code) {
    const kept = localStorage.getItem(this.place);
    if (kept !== null && kept !== code) return;
    clearTimeout(this.timer);
    localStorage.removeItem(this.place);
    this.tell(WORDS.saved);
  }

  /** Save nothing more by itself. */
  stop() {
    clearTimeout(this.timer);
  }

  /** Save what is not saved, now; `leaving` lets it go on when the page is gone. */
  async save(leaving = false) {
    // What this student has typed, whatever stands in the editor by now.
    const code = localStorage.getItem(this.place);
    if (code === null) return;
    try {
      await ask("save", this.token, { code }, leaving);
      this.saved(code);
    } catch (refusal) {
      this.tell(refusal.status ? refusal.message : WORDS.kept);
      this.later(AGAIN);
    }
  }
}
