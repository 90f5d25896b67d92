// What all pages of a class need of the browser.
import { words } from "./day_words.js";
import { make, say } from "./panel.js";

const SHOWN = 4000;
let noticed = 0;

export const byId = (id) => document.getElementById(id);

/** Say a text, and hide its element where it is empty. */
export function tell(id, text) {
  say(id, text);
  byId(id).hidden = !text;
}

/** Say something for a moment. */
export function notice(text) {
  tell("notice", text);
  clearTimeout(noticed);
  noticed = setTimeout(() => tell("notice", ""), SHOWN);
}

/** Copy what stands in an input; pages without https may use no other clipboard. */
export function copy(input) {
  input.select();
  if (document.execCommand("copy")) notice(words("student.copied"));
}

/** A button with a sign, and words for those who do not see it. */
export function signButton(sign, about, act) {
  return Object.assign(document.createElement("button"), { type: "button", textContent: sign, title: about, ariaLabel: about, onclick: act });
}

/** Show code in an element, a line each; `kind(line, number)` gives the class of a line. */
export function listing(element, code, kind = () => "") {
  element.replaceChildren(...code.split("\n").map((line, index) => make("span", kind(line, index + 1), line)));
}

/** The picture of a link, for telephones, in an element. */
export function showCode(element, svg) {
  // By a parser: pages may show pictures of this server only.
  element.replaceChildren(document.adoptNode(new DOMParser().parseFromString(svg, "image/svg+xml").documentElement));
}
