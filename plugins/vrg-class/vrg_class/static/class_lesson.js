// The steps of the lesson: which one is open, what is done, and the hint.
import { byId } from "./class_page.js";
import { words } from "./day_words.js";
import { make } from "./panel.js";

/** The tries without success after which the hint is shown by itself. */
const FAILED = 3;

export class Lesson {
  /** `steps` as the server has them; `onOpen(name)` is called when one is opened, the empty name is free play. */
  constructor(steps, onOpen) {
    Object.assign(this, { steps, onOpen, name: "", failures: {} });
    byId("show-hint").onclick = () => this.showHint(true);
    byId("opponent").onchange = () => (byId("former").hidden = byId("opponent").value === "0");
    byId("steps").onclick = ({ target }) => target.dataset.name !== undefined && this.open(target.dataset.name);
  }

  get step() {
    return this.steps.find(({ name }) => name === this.name);
  }

  /** The step to begin with: the wanted one if there is such, or else the first that is not done. */
  first(wanted) {
    if (wanted === "" || this.steps.some(({ name }) => name === wanted)) return wanted;
    return this.steps.find(({ done }) => !done)?.name ?? "";
  }

  /** The step behind the one that is open; free play behind the last one. */
  get next() {
    const index = this.steps.indexOf(this.step);
    return this.steps[index + 1] ?? { name: "", title: words("student.free") };
  }

  /** The number of the version to play against; 0 for the built-in team. */
  get against() {
    return this.step || byId("opponent").value === "0" ? 0 : Math.max(1, Math.round(Number(byId("number").value)) || 1);
  }

  open(name) {
    this.name = name;
    const { step, steps } = this, number = steps.indexOf(step) + 1;
    byId("step-title").replaceChildren(...(step ? [make("small", "", words("student.stepOf", { number, count: steps.length })), step.title] : [words("student.freeNoun")]));
    // The server renders it, and leaves nothing in it that could do harm.
    byId("text").innerHTML = step ? step.text : "";
    if (!step) byId("text").append(make("p", "", words("student.freeText")));
    byId("against").hidden = Boolean(step);
    this.showHint((this.failures[name] ?? 0) >= FAILED);
    byId("step").scrollTop = 0;
    this.list();
    this.onOpen(name);
  }

  showHint(on) {
    const hint = this.step?.hint ?? "", element = byId("hint");
    element.hidden = !hint || !on;
    byId("show-hint").hidden = !hint || on;
    element.replaceChildren(make("strong", "", words("student.hintHeading")), ...hint.split("`").map((part, index) => (index % 2 ? make("code", "", part) : part)));
    element.scrollIntoView({ block: "nearest" });
  }

  list() {
    const button = (name, text, about, done) => {
      const made = make("button", done ? "done" : "", text);
      made.dataset.name = name;
      made.title = made.ariaLabel = about;
      made.ariaCurrent = name === this.name ? "step" : "false";
      return made;
    };
    byId("steps").replaceChildren(
      ...this.steps.map(({ name, title, done }, index) => button(name, done ? `${index + 1} ✓` : `${index + 1}`, words(done ? "student.stepDone" : "student.stepOpen", { number: index + 1, title }), done)),
      button("", words("student.free"), words("student.freeNoun"), false),
    );
  }

  /** Take in that a try of a step has ended. */
  ended(name, reached) {
    const step = this.steps.find((one) => one.name === name);
    if (!step) return;
    if (reached) step.done = true;
    else this.failures[name] = (this.failures[name] ?? 0) + 1;
    if (name === this.name && this.failures[name] >= FAILED) this.showHint(true);
    this.list();
  }
}
