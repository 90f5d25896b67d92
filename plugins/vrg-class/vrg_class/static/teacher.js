// The teacher's console: who is here, who is stuck and on what, who has come how far, and a word to all.
import { byId, copy, listing, notice, showCode, tell } from "./class_page.js";
import { ask, keptToken } from "./class_server.js";
import { fill, LANGUAGE, words } from "./day_words.js";
import { make, say } from "./panel.js";

const EVERY = 2000;
/** s without a step done after which somebody may need help. */
const LONG = 300;
/** What spreadsheets of this language have between two cells. */
const SEPARATOR = LANGUAGE === "en" ? "," : ";";
const COLUMNS = ["name", "presence", "step", "doneHead", "stuck", "tries", "error", "handed"];
const t = (key, fields) => words(`teacher.${key}`, fields);
const token = keptToken("vrg-class-teacher"), body = byId("students").tBodies[0], steps = byId("done");
let halted = false, closed = false, all = [], lesson = {}, opened = null;
fill();
document.title = t("title");
byId("students").tHead.append(make("tr", "", "", ...COLUMNS.map((name) => make("th", "", t(name)))));

const minutes = (time) => `${Math.floor(time / 60)}:${String(Math.round(time) % 60).padStart(2, "0")}`;
const faulty = ({ error, line }) => (error ? (line ? t("line", { line }) : "") + error : "");

/** The cells of a student: text and class of each, in the order of the table. */
function cells(student) {
  const { here, step, done, stuck, tries, handed, problem } = student, count = Object.keys(lesson).length, waits = here && done.length < count;
  return [
    [`${here ? "●" : "○"} ${t(here ? "here" : "away")}`, "presence"], [tries || step ? lesson[step] ?? t("free") : "–", ""], [t("done", { count: done.length, all: count }), "number"],
    [waits ? minutes(stuck) : "–", waits && stuck > LONG ? "number long" : "number"], [String(tries), "number"],
    [faulty(student), "error"], [handed ? t("version", { number: handed }) + (problem ? ` · ${t("doesNotPlay")}` : "") : "–", problem ? "number error" : "number"],
  ];
}

/** Write what has changed into the rows, so that a row stays under the finger. */
function show(table, texts) {
  while (table.rows.length > all.length) table.deleteRow(-1);
  all.forEach((student, index) => {
    const row = table.rows[index] ?? table.appendChild(make("tr", "", "", make("td", "", "", make("button"))));
    const button = row.querySelector("button");
    if (button.textContent !== student.name) button.textContent = student.name;
    row.classList.toggle("here", student.here);
    texts(student).forEach(([text, name], at) => {
      const cell = row.cells[at + 1] ?? row.appendChild(make("td"));
      if (cell.textContent !== text) cell.textContent = text;
      cell.className = name;
      cell.dataset.label = COLUMNS[at + 1] ? t(COLUMNS[at + 1]) : "";
    });
  });
}

/** The table of the steps: a mark for each that is done. */
function showSteps() {
  if (!steps.tHead.rows.length) {
    const heads = Object.entries(lesson).map(([name, title]) => Object.assign(make("th", "", title), { title: name }));
    steps.tHead.append(make("tr", "", "", make("th", "", t("name")), ...heads));
  }
  show(steps.tBodies[0], ({ done, step }) => Object.keys(lesson).map((name) => [done.includes(name) ? "✓" : name === step ? "…" : "", "step"]));
}

async function look() {
  try {
    const found = await ask("teacher", token), { message, busy, jobs } = found;
    ({ halted, closed, steps: lesson } = found);
    all = found.students.sort((a, b) => a.name.localeCompare(b.name));
    show(body, cells);
    showSteps();
    const here = all.filter((student) => student.here).length, running = busy ? t("running", { n: busy, jobs }) : t("idle");
    const absent = found.absent.length ? t("absent", { names: found.absent.join(", ") }) : "";
    say("summary", [all.length ? t("count", { here, all: all.length }) : t("none"), running, absent, message && `“${message}”`].filter(Boolean).join(" · "));
    const open = found.sealed ? "" : [t("unsealed"), found.lacking && t("lacking", { what: found.lacking })].filter(Boolean).join(" ");
    warn([open, found.roster && t("roster", { words: found.roster }), ...found.problems].filter(Boolean).join(" · "));
    say("halt", t(halted ? "goOn" : "halt"));
    byId("halt").ariaPressed = String(halted);
    say("shut", t(closed ? "reopen" : "shut"));
    byId("shut").ariaPressed = String(closed);
  } catch (refusal) {
    warn(refusal.status ? refusal.message : t("lost"));
  }
}

const warn = (text) => tell("warning", text);

/** Ask for something, say that it was done, and look again; the answer, or null. */
async function act(path, what, done = "") {
  try {
    const answer = await ask(path, token, what);
    if (done) notice(done);
    await look();
    return answer;
  } catch (refusal) {
    notice(refusal.message);
    return null;
  }
}

/** Show the code of a student, the error, and the student's own link. */
async function open(student) {
  const found = await act("teacher/code", { student: student.id });
  if (!found) return;
  opened = student;
  say("person-name", student.name);
  say("person-error", faulty(student));
  byId("another-name").value = student.name;
  listing(byId("person-code"), found.code, (_, number) => (student.error && number === student.line ? "faulty" : ""));
  showLink(student.link);
  if (!byId("person").open) byId("person").showModal();
  byId("person-code").querySelector(".faulty")?.scrollIntoView({ block: "center" });
}

function showLink(link) {
  const own = `${location.origin}/#${link}`;
  byId("person-link").value = own;
  ask("qr", token, { text: own }).then(({ svg }) => showCode(byId("person-qr"), svg), (refusal) => notice(refusal.message));
}

/** The progress of all, as a table that spreadsheets read. */
function table() {
  // A cell that begins so would be a formula.
  const cell = (text) => `"${String(text).replace(/^[=+\-@\t\r]/, "'$&").replaceAll('"', '""')}"`;
  const head = [t("name"), ...Object.values(lesson), t("tries"), t("handed"), t("error")];
  const rows = all.map((one) => [one.name, ...Object.keys(lesson).map((name) => (one.done.includes(name) ? 1 : 0)), one.tries, one.handed, faulty(one)]);
  return `\ufeff${[head, ...rows].map((row) => row.map(cell).join(SEPARATOR)).join("\r\n")}\r\n`;
}

function showView(isProgress) {
  byId("students").hidden = isProgress;
  steps.hidden = !isProgress;
  byId("now").ariaPressed = String(!isProgress);
  byId("progress").ariaPressed = String(isProgress);
}

for (const rows of [body, steps.tBodies[0]]) {
  rows.addEventListener("click", ({ target }) => {
    const row = target.closest("tr");
    if (row) open(all[row.sectionRowIndex]);
  });
}
byId("now").addEventListener("click", () => showView(false));
byId("progress").addEventListener("click", () => showView(true));
byId("export").addEventListener("click", () => {
  const href = URL.createObjectURL(new Blob([table()], { type: "text/csv" }));
  Object.assign(document.createElement("a"), { href, download: "progress.csv" }).click();
  URL.revokeObjectURL(href);
});
byId("close").addEventListener("click", () => byId("person").close());
byId("halt").addEventListener("click", () => act("teacher/decide", { halted: !halted }));
byId("shut").addEventListener("click", () => act("teacher/decide", { closed: !closed }));
byId("all").addEventListener("submit", (event) => {
  event.preventDefault();
  act("teacher/decide", { message: byId("message").value.trim() }, t("sent"));
  byId("message").value = "";
});
byId("clear").addEventListener("click", () => act("teacher/decide", { message: "" }, t("cleared")));
byId("person-copy").addEventListener("click", () => copy(byId("person-link")));
byId("add").addEventListener("submit", async (event) => {
  event.preventDefault();
  const name = byId("new-name").value, found = await act("teacher/change", { act: "add", name }, t("added", { name }));
  if (!found) return;
  byId("new-name").value = "";
  open(all.find(({ id }) => id === found.id));
});
byId("rename").addEventListener("submit", async (event) => {
  event.preventDefault();
  if (await act("teacher/change", { act: "rename", student: opened.id, name: byId("another-name").value }, t("renamed"))) byId("person").close();
});
byId("acts").addEventListener("click", async ({ target }) => {
  const what = target.dataset.act;
  if (!what || !window.confirm(t(`sure.${what}`, { name: opened.name }))) return;
  const found = await act("teacher/change", { act: what, student: opened.id }, t(`did.${what}`));
  if (!found) return;
  if (what === "revoke") showLink(found.link);
  else byId("person").close();
});

showView(false);
if (token) {
  look();
  setInterval(look, EVERY);
} else warn(t("noLink"));
