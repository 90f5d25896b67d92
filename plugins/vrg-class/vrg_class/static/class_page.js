// What all pages of a class need of the browser.
import { WORDS } from "./class_words.js";
import { say } from "./panel.js";

const SHOWN = 4000;
let noticed = 0;

export const byId = (id) => document.getElementById(id);

/** Say a text, and hide its element where it is empty. */
export function tell(id, words) {
  say(id, words);
  byId(id).hidden = !words;
}

/** Say something for a moment. */
export function notice(words) {
  tell("notice", words);
  clearTimeout(noticed);
  noticed = setTimeout(() => tell("notice", ""), SHOWN);
}

/** Copy what stands in an input; pages without https may use no other clipboard. */
export function copy(input) {
  input.select();
  if (document.execCommand("copy")) notice(WORDS.copied);
}

/** A button with a sign, and words for those who do not see it. */
export function signButton(sign, about, act) {
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: sign, title: about, ariaLabel: about });
  button.addEventListener("click", act);
  return button;
}
