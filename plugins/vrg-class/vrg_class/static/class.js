// The page of a student: joining, and the workshop.
import { Board } from "./class_board.js";
import { Editor } from "./class_editor.js";
import { forgetOwn, ownLink, ownToken, readAddress, showJoining } from "./class_join.js";
import { Keeper, sendLeft } from "./class_keeper.js";
import { Lesson } from "./class_lesson.js";
import { byId, copy, notice, signButton, tell } from "./class_page.js";
import { Player } from "./class_player.js";
import { ask, CHANGED, Feed, UNKNOWN } from "./class_server.js";
import { oddSign } from "./class_signs.js";
import { Output, Values } from "./class_told.js";
import { fault, FIRST, outcome, Recording } from "./class_try.js";
import { askWhich, listVersions } from "./class_versions.js";
import { drop, isLacking, keep, kept } from "./storage.js";
import { fill, value, words } from "./day_words.js";
import { Field } from "./field.js";
import { Match } from "./match.js";
import { say } from "./panel.js";

const BOARD_EVERY = 5000;
const KEYS = [["indent", "⇥"], ["outdent", "⇤"], ["(", "("], [")", ")"], [":", ":"], [".", "."], ["_", "_"], ["=", "="], ['"', '"'], ["undo", "↶"]];
const { body } = document;
fill();

const match = new Match();
const field = new Field(byId("field"), byId("ground"));
const player = new Player(byId("replay"), () => showEnd());
const editor = new Editor(byId("editor"), () => me && keeper.changed(), () => tryIt());
const output = new Output(byId("output"), goTo);
const values = new Values(byId("view"), (text) => {
  editor.insert(text);
  notice(words("student.inserted", { text }));
});
let me = null, token = "", keeper = null, lesson = null, feed = null, board = null;
/** A try was asked for here, and has not begun; what the class has to say; the last try has been told to its end. */
let asked = false, news = { message: "", halted: false }, told = true;

// Coming and going

async function enter() {
  token = ownToken();
  if (!token) return showJoining("", enter);
  try {
    let found = await ask("me", token);
    const { sent, here, there } = await sendLeft(found.id, token);
    if (sent) found = await ask("me", token);
    begin(found);
    if (there) keeper.isStale(here, there);
  } catch (refusal) {
    if (refusal.status === 401) return showJoining(refusal.message, enter);
    if (!me) body.dataset.screen = "wait";
    notice(refusal.message);
    setTimeout(enter, 3000);
  }
}

function begin(found) {
  say("game", found.game);
  say("student", found.name);
  document.title = `${found.name} · VRG`;
  byId("own-link").value = ownLink();
  if (me?.id === found.id && keeper.unsaved) keeper.token = token; // what is typed here goes on
  else {
    keeper?.stop();
    editor.code = found.code;
    keeper = new Keeper(found.id, token, found.revision, () => editor.code, (text) => say("saved", text), which);
    say("saved", words("student.saved"));
  }
  me = found;
  const place = `vrg-class-step-${found.id}`;
  lesson = new Lesson(found.steps, (name) => {
    keep(place, name);
    showStart(name);
  });
  lesson.open(lesson.first(kept(place) ?? (found.messages ? found.step : null)));
  byId("board").replaceChildren();
  board = new Board(byId("board"), found.name);
  showVersion();
  hear(found);
  body.dataset.screen = "work";
  feed?.stop();
  feed = new Feed(token, take, showLink);
  if (isLacking()) notice(words("student.unkept"));
}

/** The class has newer code: ask with which one to go on. What is not chosen stays as a version. */
function which(here, there) {
  askWhich(here, there.code, (isHere) => {
    keeper.chosen(there.revision);
    if (!isHere) {
      editor.replace(there.code);
      return keeper.saved(there.code, there.revision);
    }
    if (editor.code !== here && editor.code === there.code) editor.replace(here);
    keeper.changed(true);
    keeper.save();
  });
}

/** Take former code back. What stands here is kept as a version. */
async function takeBack(code, number) {
  editor.replace(code);
  keeper.changed(true);
  await keeper.save();
  if (keeper.unsaved) return; // it is told, and tried again
  notice(words("student.tookBack", { number }));
  listVersions(token, takeBack);
}

async function leave() {
  await keeper.save();
  keeper.stop();
  feed.stop();
  forgetOwn();
  drop(`vrg-class-step-${me.id}`);
  [feed, me] = [null, null];
  showJoining("", enter);
}

function showLink({ open, refused }) {
  if (refused === CHANGED) return void enter();
  const offline = isLacking() ? "student.offlineUnkept" : "student.offline";
  tell("lost", open ? "" : words(refused === UNKNOWN ? "refused.unknown" : refused ? "student.crowded" : offline));
  if (open) keeper.save();
}

/** Take in what the teacher says to all. */
function hear({ message, halted }) {
  news = { message, halted };
  const problem = me?.problem && words("student.playsNot", { why: fault(explained(me.problem)) });
  tell("news", [message, halted && words("student.halted"), problem].filter(Boolean).join(" · "));
}

function showVersion() {
  say("version", words(me.handed ? "student.handed" : "student.notHanded", { version: me.handed }));
  byId("number").max = Math.max(1, me.versions);
  byId("number").value ||= Math.max(1, me.versions - 1);
}

// Tries

async function tryIt() {
  if (!me) return;
  asked = true;
  showTab("field", false);
  result(words("student.asking"), "busy");
  try {
    const { version, place, halted } = await keeper.send("try", { step: lesson.name, against: lesson.against });
    me.versions = version;
    if (place && !player.recording.begun) player.recording.place = place;
    hear({ ...news, halted });
    showVersion();
  } catch (refusal) {
    asked = false;
    notice(refusal.message);
    if (told) result(refusal.message, "bad");
  }
}

async function handIn() {
  try {
    me.handed = (await keeper.send("hand-in")).version;
    me.problem = null;
    hear(news);
    me.versions = Math.max(me.versions, me.handed);
    showVersion();
    notice(words("student.handedNow", { version: me.handed }));
    showBoard();
  } catch (refusal) {
    notice(refusal.message);
  }
}

/** Show another recording from its beginning; a `quiet` one stands until somebody plays it. */
function load(recording, quiet) {
  const { end, step } = player.recording;
  if (!told && end) lesson.ended(step, end.goal?.reached != null);
  player.load(recording, quiet);
  match.forget();
  output.forget();
  values.own([]);
  editor.mark(null);
  told = quiet;
  if (quiet) result(words(recording.version ? "student.watch" : "student.notStarted"));
}

/** Show the field and the robots as a step begins, until it is tried. */
async function showStart(name) {
  const recording = new Recording();
  load(recording, true);
  const found = await ask("start", token, { step: name }).catch(() => []);
  if (player.recording !== recording) return;
  for (const message of found) if (["about", "at", "view"].includes(message.t)) accept(message);
  player.to(recording.last); // the field is not known before
}

function take(message) {
  const { recording } = player;
  if (message.t === "news") return hear(message);
  if (message.t === "saved") return follow(message);
  if (message.t === "plays") {
    me.problem = message.problem;
    return hear(news);
  }
  if (message.t === "begin") {
    const { step, version } = message, { time, playing } = player, shown = step === lesson.name;
    // After a reconnection the last try comes again, and goes on where it was.
    const again = !asked && version === recording.version && step === recording.step;
    load(shown ? new Recording(step, version) : new Recording(), !shown || (!asked && !playing));
    if (again) Object.assign(player, { time, playing });
    asked = false;
    return;
  }
  if (recording.version) accept(message); // or else it is of another step than the one that is open
}

/** Another page of this student has saved: show the same code, unless something was typed here meanwhile. */
function follow({ code, revision }) {
  if (!keeper.follows(code, revision)) return;
  if (editor.code !== code) editor.follow(code);
  keeper.saved(code, revision);
}

/** An error with words for a beginner, in the language of the page. */
function explained(message) {
  const sign = message.kind === "SyntaxError" ? oddSign(editor.textOf(message.line)) : null;
  const kind = sign?.kind ?? message.kind, text = value(`faults.${kind}`) ? words(`faults.${kind}`, sign ?? message) : message.text;
  return { ...message, text, place: sign?.place, hint: sign ? "" : value(`hints.${kind}`) ?? "" };
}

/** Take in a message of what is shown. */
function accept(message) {
  if (message.t === "error") message = explained(message);
  const { recording } = player, own = recording.about?.own ?? [];
  recording.take(message);
  output.take(message, own);
  if (message.t === "about") {
    match.colours = message.colours;
    for (const [name, colour] of Object.entries(message.colours)) document.documentElement.style.setProperty(`--${name}`, colour);
    values.own(message.own);
  }
  if (message.t === "error" && recording.errors.length === 1) {
    if (message.line) editor.mark(message);
    if (player.playing) showTold("output");
  }
  // A try that shows nothing has nothing to wait for.
  if (message.t === "end" && (!recording.begun || !player.playing)) showEnd();
}

/** Tell how the try has ended, once what is played has come to its end. */
function showEnd() {
  const { recording } = player, { step, end } = recording, reached = Boolean(end.goal?.reached != null);
  if (!told || reached) lesson.ended(step, reached);
  told = true;
  const { words: text, kind, line } = outcome(recording), { name, title } = lesson.next;
  if (line) return showFault(text, line);
  if (!reached) return result(text, kind);
  result(text, kind, words("student.nextStep", { title }), () => {
    lesson.open(name);
    showTab("step");
  });
}

const showFault = (text, line) => result(text, "bad", line ? words("student.seeCode") : "", () => goTo(null, line));

function result(text, kind = "", button = "", act = null) {
  say("result-words", text);
  tell("result-act", button);
  byId("result-act").onclick = act;
  if (byId("result").dataset.kind !== kind) byId("result").dataset.kind = kind;
}

// What is shown

function showTab(tab, focus = true) {
  body.dataset.tab = tab;
  if (tab === "more" && !["board", "more"].includes(body.dataset.told)) showTold("board");
  if (tab === "field" && !["output", "view"].includes(body.dataset.told)) showTold("output");
  for (const button of document.querySelectorAll("#bar [data-tab]")) button.ariaPressed = String(button.dataset.tab === tab);
  if (tab === "code" && focus) editor.view.focus();
}

function showTold(name) {
  body.dataset.told = name;
  for (const tab of document.querySelectorAll("#tabs button")) {
    tab.ariaSelected = String(tab.dataset.told === name);
    byId(tab.dataset.told).hidden = tab.dataset.told !== name;
  }
  showBoard();
  if (name === "more" && me) listVersions(token, takeBack);
}

async function showBoard() {
  if (!me || body.dataset.told !== "board" || document.hidden) return;
  const found = await ask("board", token).catch(() => null);
  if (found) board.show(found.rows, found.pages);
}

/** Go to the time and to the line of a row. */
function goTo(time, line) {
  if (time !== null) player.to(time);
  if (!line) return;
  showTab("code");
  editor.goTo(line);
}

function draw(now) {
  requestAnimationFrame(draw);
  if (!me) return;
  const { recording } = player, time = player.tick(now);
  if (!told && recording.version) {
    const { errors, begun, place } = recording;
    const waits = words(`student.${news.halted ? "halted" : place === 1 ? "next" : place ? "queue" : "asking"}`, { place });
    if (errors.length) showFault(fault(errors[0]), errors[0].line);
    else result(begun ? words("student.playing") : waits, "busy");
  }
  if (recording.begun) for (const message of recording.at(Math.max(time, FIRST), 1)) match.take(message, now / 1000);
  field.draw(match, now / 1000, values.player);
  tell("idle", recording.begun || !told ? "" : words("student.idle"));
  output.show(time);
  if (body.dataset.told === "view") values.show(recording.viewAt(values.player, time));
}

// What people do

byId("try").addEventListener("click", tryIt);
byId("hand-in").addEventListener("click", handIn);
byId("leave").addEventListener("click", leave);
byId("copy").addEventListener("click", () => copy(byId("own-link")));
byId("field").addEventListener("click", ({ offsetX, offsetY }) => {
  const name = field.robotAt(offsetX, offsetY);
  if (!player.recording.about?.own.includes(name)) return;
  values.choose(name);
  showTold("view");
});
byId("tabs").addEventListener("click", ({ target }) => target.dataset.told && showTold(target.dataset.told));
byId("bar").addEventListener("click", ({ target }) => target.dataset.tab && showTab(target.dataset.tab));
byId("keys").append(...KEYS.map(([key, sign]) => {
  const button = signButton(sign, key, () => editor.press(key));
  button.addEventListener("pointerdown", (event) => event.preventDefault()); // the keyboard stays
  return button;
}));
window.addEventListener("keydown", (event) => {
  if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey) || event.defaultPrevented) return;
  event.preventDefault();
  tryIt();
});
document.addEventListener("visibilitychange", () => document.hidden && keeper?.save(true));
window.addEventListener("hashchange", () => {
  readAddress();
  if (ownToken() !== token) enter();
});
// The keyboard of a telephone covers the page, which stays above it.
window.visualViewport?.addEventListener("resize", ({ target: { height, scale } }) => {
  document.documentElement.style.setProperty("--high", scale > 1 ? "" : `${height}px`);
});
setInterval(showBoard, BOARD_EVERY);

// For tests, and for whoever wants to know.
window.vrg = { match, field, player, editor, values, get keeper() { return keeper; } };
readAddress();
showTab("step");
showTold("output");
requestAnimationFrame(draw);
enter();
