// Who a student is: the token in the address or kept by the browser, and joining.
import { byId, tell } from "./class_page.js";
import { ask, takeHash } from "./class_server.js";
import { drop, keep, kept } from "./storage.js";
import { words } from "./day_words.js";

const OWN = "vrg-class-student", JOINING = "vrg-class-joining", DEVICE = "vrg-class-device";

/** Read the address, and keep what it has for a reload; a browser that keeps nothing has it in the address. */
export function readAddress() {
  const hash = takeHash();
  if (hash && !(hash.startsWith("join=") ? keep(JOINING, hash.slice(5)) : keep(OWN, hash))) history.replaceState(null, "", `#${hash}`);
}

/** Keep who a student is. */
function keepOwn(token) {
  if (!keep(OWN, token)) history.replaceState(null, "", `#${token}`);
}

export const ownToken = () => kept(OWN) ?? "";
export const forgetOwn = () => drop(OWN);
export const ownLink = () => `${location.origin}/#${ownToken()}`;

/** What tells this device from others of the same school. */
function device() {
  const found = kept(DEVICE) ?? crypto.getRandomValues(new Uint32Array(4)).join("-");
  keep(DEVICE, found);
  return found;
}

/** Show where one joins, with a problem if there is one; `onJoined()` is called once the token is kept. */
export function showJoining(problem, onJoined) {
  const joining = kept(JOINING), form = document.querySelector("#join form");
  document.body.dataset.screen = "join";
  form.querySelectorAll("input, button").forEach((element) => (element.disabled = !joining));
  tell("join-problem", problem || (joining ? "" : words("student.noLink")));
  byId("name").focus();
  form.onsubmit = async (event) => {
    event.preventDefault();
    byId("join-button").disabled = true;
    try {
      const { token } = await ask("join", joining, { name: byId("name").value, word: byId("word").value.trim(), device: device() });
      keepOwn(token);
      tell("join-problem", "");
      onJoined();
    } catch (refusal) {
      tell("join-problem", refusal.message);
      byId(["roster", "guesses"].includes(refusal.why) ? "word" : "name").focus();
    } finally {
      byId("join-button").disabled = false;
    }
  };
}
