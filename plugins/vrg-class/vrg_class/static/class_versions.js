// Former versions of the code, and the question which code is to stay where two devices have changed it.
import { byId, listing, notice } from "./class_page.js";
import { ask } from "./class_server.js";
import { words } from "./day_words.js";
import { make } from "./panel.js";

/** How long ago something was, in words; `age` in s. */
function ago(age) {
  const [key, length] = [["days", 86400], ["hours", 3600], ["minutes", 60]].find(([, length]) => age >= length) ?? ["now", 1];
  return words(`student.${key}`, { n: Math.floor(age / length) });
}

/** List the versions of a student; `onTake(code, number)` is called when one is taken back. */
export async function listVersions(token, onTake) {
  const found = await ask("versions", token).catch((refusal) => void notice(refusal.message));
  if (!found) return;
  const rows = found.map(({ number, age, lines, handed }) => {
    const button = make("button", "", words("student.look")), about = words("student.versionRow", { number, lines, age: ago(age) });
    button.addEventListener("click", () => look(token, number, onTake));
    return make("li", "", "", make("span", "", about, handed ? make("small", "", words("student.versionHanded")) : ""), button);
  });
  byId("versions").replaceChildren(...(rows.length ? rows : [make("li", "nothing", words("student.noVersions"))]));
}

async function look(token, number, onTake) {
  try {
    const { code } = await ask("version", token, { number });
    byId("former-title").textContent = words("student.version", { number });
    listing(byId("former-text"), code);
    byId("former-take").onclick = () => {
      byId("former-code").close();
      onTake(code, number);
    };
    byId("former-code").showModal();
  } catch (refusal) {
    notice(refusal.message);
  }
}

/** Ask which code is to stay: that of this page, or the newer one. `onChosen(isHere)` is called, once. */
export function askWhich(here, there, onChosen) {
  const lines = [here, there].map((code) => new Set(code.split("\n")));
  listing(byId("stale-here"), here, (line) => (lines[1].has(line) ? "" : "changed"));
  listing(byId("stale-there"), there, (line) => (lines[0].has(line) ? "" : "changed"));
  const dialog = byId("stale"), choose = (isHere) => () => {
    dialog.close();
    onChosen(isHere);
  };
  byId("keep-here").onclick = choose(true);
  byId("keep-there").onclick = choose(false);
  dialog.oncancel = (event) => event.preventDefault(); // it must be answered
  if (!dialog.open) dialog.showModal();
  dialog.querySelectorAll("pre .changed").forEach((line) => line.scrollIntoView({ block: "nearest" }));
}

byId("former-close").addEventListener("click", () => byId("former-code").close());
