// What is told beside the field: what the code prints, errors and calls of the referee; and what a robot knows.
import { newest } from "./recording.js";
import { seconds } from "./class_try.js";
import { words } from "./day_words.js";
import { make } from "./panel.js";

const MOST_ROWS = 1000;

/** The list of what was printed, of errors and of calls. */
export class Output {
  /** Stand within a list; `onGo(time, line)` is called when a row is pressed, either may be null. */
  constructor(list, onGo) {
    Object.assign(this, { list, onGo });
    this.forget();
  }

  forget() {
    Object.assign(this, { rows: [], now: null, timed: [] });
    this.list.replaceChildren(make("li", "nothing", words("student.noOutput")));
  }

  /** Take in a message of a try whose own players are `own`. */
  take({ t, time, player, line, text, hint, call }, own) {
    if (this.rows.length >= MOST_ROWS && t !== "error") return;
    if (t === "print") this.add(t, time, null, text, own.length > 1 ? player : "");
    if (t === "error") this.add(t, time, line, text, line ? words("student.line", { line }) : "", hint);
    if (t === "call") this.add(t, time, null, call.text, words("student.referee"), call.words);
  }

  add(kind, time, line, text, about, more = "") {
    const last = this.rows.at(-1), key = JSON.stringify([kind, line, text, about]);
    if (kind !== "call" && last?.key === key) {
      last.count += 1;
      last.times.textContent = `× ${last.count}`;
      return;
    }
    const times = make("span", "times"), told = make("span", "words", text, times);
    if (about) told.prepend(make("small", "", about));
    if (more && kind === "error") told.append(make("p", "hint", more));
    const row = make("button", "", "", make("time", "", time == null ? "" : seconds(time)), told), item = make("li", kind, "", row);
    row.title = kind === "call" ? more : time == null ? "" : words("student.goTo", { time: seconds(time) });
    row.addEventListener("click", () => this.onGo(time ?? null, line ?? null));
    if (!this.rows.length) this.list.replaceChildren();
    // Errors come when the try is over, and belong where they happened.
    const at = time == null ? -1 : newest(this.timed, time);
    if (time != null) this.timed.splice(at + 1, 0, { time, item });
    this.rows.push({ key, times, count: 1 });
    if (this.timed[at + 2]) this.list.insertBefore(item, this.timed[at + 2].item);
    else this.list.append(item);
  }

  /** Mark what was told last at a time. */
  show(time) {
    const now = this.timed[newest(this.timed, time)]?.item ?? null;
    if (now === this.now) return;
    this.now?.classList.remove("now");
    now?.classList.add("now");
    this.now = now;
    const { list } = this;
    if (now && !list.matches(":hover")) list.scrollTop = now.offsetTop - list.clientHeight / 2;
  }
}

/** The table of what a robot knows at an instant. */
export class Values {
  /** Stand within an element; `onInsert(text)` is called when a name is pressed. */
  constructor(parent, onInsert) {
    this.select = make("select");
    this.select.ariaLabel = words("student.robot");
    this.select.addEventListener("change", () => (this.player = this.select.value));
    this.body = make("tbody");
    this.help = make("p", "help", words("student.noView"));
    this.body.addEventListener("click", ({ target }) => {
      const text = target.closest("button")?.textContent;
      if (text) onInsert(text.split(": ")[0]);
    });
    parent.append(make("div", "choice", "", this.select, this.help), make("table", "values", "", this.body));
    this.own([]);
  }

  /** Offer these robots; the first one is chosen unless another one was. */
  own(names) {
    this.select.replaceChildren(...names.map((name) => new Option(name)));
    this.select.hidden = names.length < 2;
    this.choose(names.includes(this.player) ? this.player : names[0] ?? "");
    this.show(undefined);
  }

  choose(name) {
    this.player = this.select.value = name;
  }

  /** Show what a robot saw, a message of the try or undefined. */
  show(view) {
    if (view === this.shown && this.names) return;
    this.shown = view;
    const values = view?.values ?? [], names = values.map(([name]) => name).join("\n");
    if (names !== this.names) {
      this.names = names;
      this.body.replaceChildren(...values.map(([name]) => make("tr", "", "", make("th", "", "", make("button", "", name)), make("td"))));
      this.help.textContent = values.length ? words("student.viewHelp") : words("student.noView");
    }
    values.forEach(([, value], index) => {
      const cell = this.body.rows[index].cells[1];
      cell.classList.toggle("new", cell.textContent !== "" && cell.textContent !== value);
      if (cell.textContent !== value) cell.textContent = value;
    });
  }
}
