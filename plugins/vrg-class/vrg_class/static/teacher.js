// The teacher's console: who is here, who is stuck and on what, and a word to all.
import { byId, copy, notice, tell } from "./class_page.js";
import { ask, keptToken } from "./class_server.js";
import { TEACHER } from "./class_words.js";
import { make, say } from "./panel.js";

const EVERY = 2000;
/** s without a step done after which somebody may need help. */
const LONG = 300;
const token = keptToken("vrg-class-teacher"), body = byId("students").tBodies[0];
const labels = [...document.querySelectorAll("#students th")].map((head) => head.textContent);
let halted = false, all = [];

const minutes = (time) => `${Math.floor(time / 60)}:${String(Math.round(time) % 60).padStart(2, "0")}`;

/** The cells of a student: text and class of each, in the order of the table. */
function cells({ here, step, done, stuck, tries, error, line, handed }, lesson) {
  const waits = here && done < lesson;
  return [
    [here ? `● ${TEACHER.here}` : `○ ${TEACHER.away}`, "presence"], [tries || step ? step || TEACHER.free : "–", ""], [TEACHER.done(done, lesson), "number"],
    [waits ? minutes(stuck) : "–", waits && stuck > LONG ? "number long" : "number"], [String(tries), "number"],
    [error ? TEACHER.line(line) + error : "", "error"], [TEACHER.version(handed), "number"],
  ];
}

/** Write what has changed into the rows, so that a row stays under the finger. */
function show({ students, lesson }) {
  all = [...students].sort((a, b) => a.name.localeCompare(b.name));
  while (body.rows.length > all.length) body.deleteRow(-1);
  all.forEach((student, index) => {
    const row = body.rows[index] ?? body.appendChild(make("tr", "", "", make("td", "", "", make("button")), ...labels.slice(1).map(() => make("td"))));
    const button = row.querySelector("button");
    if (button.textContent !== student.name) button.textContent = student.name;
    row.classList.toggle("here", student.here);
    cells(student, lesson).forEach(([text, name], at) => {
      const cell = row.cells[at + 1];
      if (cell.textContent !== text) cell.textContent = text;
      cell.className = name;
      cell.dataset.label = labels[at + 1];
    });
  });
}

async function look() {
  try {
    const found = await ask("teacher", token);
    halted = found.halted;
    show(found);
    const here = all.filter((student) => student.here).length, { message } = found;
    say("summary", all.length ? [TEACHER.count(here, all.length), TEACHER.status(found.busy, found.jobs), message && `“${message}”`].filter(Boolean).join(" · ") : TEACHER.none);
    warn(found.sealed ? "" : [TEACHER.unsealed, found.lacking && TEACHER.lacking(found.lacking)].filter(Boolean).join(" "));
    say("halt", halted ? TEACHER.goOn : TEACHER.halt);
    byId("halt").ariaPressed = String(halted);
  } catch (refusal) {
    warn(refusal.status ? refusal.message : TEACHER.lost);
  }
}

const warn = (words) => tell("warning", words);

async function decide(what, words = "") {
  try {
    await ask("teacher/decide", token, what);
    if (words) notice(words);
    await look();
  } catch (refusal) {
    notice(refusal.message);
  }
}

/** Show the code of a student, the error, and the student's own link. */
async function open({ name, error, line, link }) {
  try {
    const { code } = await ask("teacher/code", token, { name }), own = `${location.origin}/#${link}`;
    say("person-name", name);
    say("person-error", error ? TEACHER.line(line) + error : "");
    byId("person-code").replaceChildren(...code.split("\n").map((text, index) => make("span", error && index + 1 === line ? "faulty" : "", text)));
    byId("person-link").value = own;
    byId("person-qr").src = `qr.svg?text=${encodeURIComponent(own)}`;
    byId("person").showModal();
    byId("person-code").querySelector(".faulty")?.scrollIntoView({ block: "center" });
  } catch (refusal) {
    notice(refusal.message);
  }
}

body.addEventListener("click", ({ target }) => {
  const row = target.closest("tr");
  if (row) open(all[row.rowIndex - 1]);
});
byId("close").addEventListener("click", () => byId("person").close());
byId("halt").addEventListener("click", () => decide({ halted: !halted }));
byId("all").addEventListener("submit", (event) => {
  event.preventDefault();
  decide({ message: byId("message").value.trim() }, TEACHER.sent);
  byId("message").value = "";
});
byId("clear").addEventListener("click", () => decide({ message: "" }, TEACHER.cleared));
byId("person-copy").addEventListener("click", () => copy(byId("person-link")));

if (token) {
  look();
  setInterval(look, EVERY);
} else warn(TEACHER.noLink);
