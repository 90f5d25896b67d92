// Who a student is: the token in the address or kept by the browser, and joining.
import { byId, tell } from "./class_page.js";
import { ask, takeHash } from "./class_server.js";
import { WORDS } from "./class_words.js";

const OWN = "vrg-class-student", JOINING = "vrg-class-joining";

/** Read the address, and keep what it has for a reload. */
export function readAddress() {
  const hash = takeHash();
  if (hash.startsWith("join=")) localStorage.setItem(JOINING, hash.slice(5));
  else if (hash) localStorage.setItem(OWN, hash);
}

export const ownToken = () => localStorage.getItem(OWN) ?? "";
export const forgetOwn = () => localStorage.removeItem(OWN);
export const ownLink = () => `${location.origin}/#${ownToken()}`;

/** Show where one joins, with a problem if there is one; `onJoined()` is called once the token is kept. */
export function showJoining(problem, onJoined) {
  const joining = localStorage.getItem(JOINING), form = document.querySelector("#join form");
  document.body.dataset.screen = "join";
  form.querySelectorAll("input, button").forEach((element) => (element.disabled = !joining));
  tell("join-problem", problem || (joining ? "" : WORDS.noLink));
  byId("name").focus();
  form.onsubmit = async (event) => {
    event.preventDefault();
    byId("join-button").disabled = true;
    try {
      const { token } = await ask("join", joining, { name: byId("name").value, word: byId("word").value.trim() });
      localStorage.setItem(OWN, token);
      tell("join-problem", "");
      onJoined();
    } catch (refusal) {
      tell("join-problem", refusal.message);
      byId(/word/.test(refusal.message) ? "word" : "name").focus();
    } finally {
      byId("join-button").disabled = false;
    }
  };
}
