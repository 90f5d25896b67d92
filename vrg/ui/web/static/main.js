// Connects the parts of the page: the connection, what is known of the match, the field, the panel, and a driver's hands.
import { Controls } from "./controls.js";
import { Drawers } from "./drawers.js";
import { Field } from "./field.js";
import { Link } from "./link.js";
import { Match } from "./match.js";
import { Panel, say } from "./panel.js";
import { PendingStop } from "./stop.js";
import { drop, keep, kept, TAB } from "./storage.js";
import { KEYS, WORDS } from "./words.js";

/** ms between two driving commands, and ms without news after which the picture is said to be old. */
const COMMAND = 50, SILENT = 3000;
/** ms for which a notice is shown, and ms in which ending the game must be confirmed. */
const NOTICE = 6000, CONFIRM = 4000;
/** The types of the fields of drawers in which letters are no keys of the page. */
const TYPED = ["search", "text", "textarea"];

const byId = (id) => document.getElementById(id);
const match = new Match();
const field = new Field(byId("field"), byId("stage"));
const panel = new Panel();
const controls = new Controls(byId("stick"), byId("knob"), () => act("estop"), () => driving && stopDriving(WORDS.padLost));
const drawers = new Drawers((request) => match.role === "official" && link.send(request));
/** The drawer for which the link has asked, which opens once it is known that it may. */
let wanted = "";
let token = takeToken();
let takeover = false;
const stop = new PendingStop(() => link.open && link.send({ t: "act", what: "estop" }));
let driving = false;
let notice = 0, confirming = 0;
const tab = [...crypto.getRandomValues(new Uint8Array(12))].map((byte) => byte.toString(16)).join("");

/** The token of the link. It leaves the address, so that it is not read off a projector; a reload still has it. */
function takeToken() {
  const [found, ...more] = location.hash.slice(1).split("&");
  // What is shown to all decides nothing, whatever else this browser has opened.
  if (!found && new URLSearchParams(location.search).has("view")) return "";
  if (found) {
    keep("token", found, TAB);
    keep("drawer", more[0] ?? "", TAB);
    history.replaceState(null, "", location.pathname + location.search);
  }
  wanted = kept("drawer", TAB) ?? "";
  return kept("token", TAB) ?? "";
}

function tell(text) {
  say("notice", text);
  byId("notice").hidden = false;
  clearTimeout(notice);
  notice = setTimeout(() => (byId("notice").hidden = true), NOTICE);
}

function openDoor(heading, words, { seat = false, again = false } = {}) {
  say("door-heading", heading);
  say("door-words", words);
  say("door-watch", again ? WORDS.again : WORDS.watch);
  byId("door-takeover").hidden = !seat;
  byId("door").hidden = false;
}

function hear(message) {
  switch (match.take(message, performance.now() / 1000)) {
    case "welcome":
      takeover = false;
      controls.rules = message.driving;
      byId("door").hidden = true;
      setRole();
      drawers.offer(match.drawers, wanted);
      wanted = "";
      break;
    case "refused":
      link.stop();
      openDoor(WORDS.doors[message.reason] ?? WORDS.doors.request, message.why, {
        seat: message.reason === "taken",
        again: !["taken", "token"].includes(message.reason),
      });
      break;
    case "displaced":
      forgetToken();
      setRole();
      openDoor(WORDS.doors.taken, WORDS.displaced(message.player));
      break;
    case "state":
      // So that the robot does not drive on by itself when the stop is released.
      if (message.estop && driving) stopDriving(WORDS.stopped(match.player));
      break;
    case "bye":
      setRole(); // there is nothing to decide, and nobody to drive, any more
      break;
    case "drawer":
      drawers.take(message);
      break;
    case "notice":
      if (!message.released) tell(message.text);
      else if (driving) stopDriving(message.text);
      break;
  }
}

function forgetToken() {
  token = "";
  drop("token", TAB);
}

function setRole() {
  stopDriving();
  document.body.dataset.role = match.role;
  byId("official").hidden = match.role !== "official" || match.ended;
  byId("seat").hidden = match.role !== "seat" || match.ended;
  document.title = [match.player, match.name, "VRG"].filter(Boolean).join(" · ");
}

const link = new Link(
  () => ({ token, tab, takeover }),
  hear,
  () => showLink(),
);

function showLink() {
  const now = performance.now(), silent = link.open && now - link.heardAt > SILENT;
  let words = WORDS.connecting, lamp = "waiting";
  if (match.ended) [words, lamp] = [WORDS.over, "ended"];
  else if (silent) [words, lamp] = [WORDS.silent, "lost"];
  else if (link.open) [words, lamp] = [WORDS.connected(WORDS.roles[match.role] + (match.player ? ` (${match.player})` : ""), match.name), "good"];
  else if (match.name) {
    const left = Math.ceil((link.nextAt - now) / 1000);
    [words, lamp] = [left > 0 ? WORDS.lost(left) : WORDS.trying, "lost"];
  }
  say("link-words", words);
  byId("lamp").className = lamp;
  byId("link").classList.toggle("loud", lamp === "lost" || lamp === "ended");
}

// Driving

function stopDriving(words = "") {
  if (driving) link.send({ t: "give_back" });
  driving = false;
  controls.letGo();
  if (words) tell(words);
}

/** The lock that keeps a telephone's screen on; browsers give it to pages of https and of localhost alone. */
let awake = null;
function keepAwake() {
  if (driving) awake ??= navigator.wakeLock?.request("screen").catch(() => null);
  else awake = awake?.then((lock) => lock?.release()) && null;
}

setInterval(() => {
  showLink();
  showStop();
  keepAwake();
  if (match.role !== "seat" || !link.open) {
    driving = false;
    return;
  }
  const hands = document.hidden ? null : controls.hands;
  driving ||= hands !== null;
  if (driving) link.send({ t: "drive", forward: hands?.forward ?? 0, turn: hands?.turn ?? 0 });
  showSeat();
}, COMMAND);

function showSeat() {
  const { player, own } = match, pad = controls.pad;
  say("seat-name", WORDS.seat(player));
  const words = !driving ? WORDS.atRest(player) : own?.hindrance ? WORDS.hindered(player, own.hindrance) : WORDS.driving(player);
  say("seat-state", words);
  const none = controls.unknown.length ? WORDS.padUnknown(controls.unknown.join(", ")) : window.isSecureContext ? WORDS.padNone : WORDS.padInsecure;
  say("seat-pad", controls.padLost ? WORDS.padLost : pad ? WORDS.pad(pad.id) : none);
  byId("give-back").disabled = !driving;
  byId("stick").classList.toggle("driving", driving);
}

/** Ask for what a button says, about a player where there is one. */
function act(what, player = "") {
  if (what === "end" && performance.now() > confirming) {
    confirming = performance.now() + CONFIRM;
    say("end", WORDS.reallyEnd);
    setTimeout(() => say("end", WORDS.end), CONFIRM);
    return;
  }
  confirming = 0;
  if (what === "estop" && match.role !== "viewer") stop.press(performance.now());
  else if (!link.send({ t: "act", what, player })) tell(WORDS.notSent);
  showStop();
}

/** What the buttons of the emergency stop say: that it is under way, or was not sent, until the bus has it. */
function showStop() {
  const lost = stop.look(performance.now(), link.open ? link.heardAt : -Infinity, Boolean(match.state?.estop));
  if (lost) tell(WORDS.stopLost);
  const words = { "": WORDS.estop, sending: WORDS.stopping, unsent: WORDS.stopNotSent }[stop.stands];
  for (const button of document.querySelectorAll(".estop")) {
    if (button.textContent !== words) button.textContent = words;
    button.classList.toggle("unsent", stop.stands === "unsent");
  }
}

document.addEventListener("click", ({ target }) => {
  if (target.dataset?.act) act(target.dataset.act, target.dataset.player);
});
byId("give-back").addEventListener("click", () => stopDriving());
byId("fast").addEventListener("click", () => {
  controls.fast = !controls.fast;
  byId("fast").setAttribute("aria-pressed", controls.fast);
});
byId("door-takeover").addEventListener("click", () => {
  takeover = true;
  byId("door").hidden = true;
  link.connect();
});
byId("door-watch").addEventListener("click", () => {
  byId("door").hidden = true;
  if (byId("door-watch").textContent === WORDS.watch) forgetToken();
  if (!link.open) link.connect();
});
window.addEventListener("hashchange", () => {
  token = takeToken();
  link.stop();
  link.connect();
});
function showPlans() {
  match.plans = !match.showsPlans;
  if (!match.strokes.length) tell(match.plans ? WORDS.noPlans : WORDS.plansHidden);
}
byId("plans").addEventListener("click", showPlans);
byId("field").addEventListener("click", ({ offsetX, offsetY }) => {
  const name = drawers.open && field.robotAt(offsetX, offsetY);
  if (name) drawers.open.select(name);
});
window.addEventListener("keydown", (event) => {
  const once = !event.repeat, asked = KEYS[event.key.toLowerCase()];
  if (event.code === "Space" && match.role !== "viewer") {
    if (once) act("estop");
    // It would press the focused button, and the arrows would scroll the page.
    event.preventDefault();
  }
  if (event.ctrlKey || event.metaKey || event.altKey || TYPED.includes(event.target.type)) return;
  if (event.key.toLowerCase() === "l" && once) showPlans();
  controls.shift = event.shiftKey;
  if (match.role === "official" && asked && once) act(asked);
  if (match.role !== "seat") return;
  if (controls.press(event.code, once)) event.preventDefault();
  if (event.code === "Escape") stopDriving();
});
window.addEventListener("keyup", (event) => {
  controls.shift = event.shiftKey;
  controls.release(event.code);
  if (event.code === "Space") event.preventDefault();
});
window.addEventListener("blur", () => controls.letGo());
document.addEventListener("visibilitychange", () => {
  if (document.hidden && driving) stopDriving(WORDS.givenBack(match.player));
});
window.addEventListener("pagehide", () => stopDriving());
window.addEventListener("contextmenu", (event) => event.target.closest("#stick") && event.preventDefault());

// Drawing

function draw() {
  panel.show(match);
  field.draw(match, performance.now() / 1000, match.player || drawers.open?.selected, drawers.open?.shapes);
  drawn += 1;
  requestAnimationFrame(draw);
}
let drawn = 0;

// For tests, and for whoever wants to know.
window.vrg = { match, field, drawers, link, controls, stop, drawn: () => drawn };
link.connect();
requestAnimationFrame(draw);
