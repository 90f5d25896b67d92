// Shows a recorded match, with a bar of time. It asks the server for one instant after the other, or has it all itself.
import { Field } from "./field.js";
import { Match } from "./match.js";
import { Panel, say } from "./panel.js";
import { packed, Recording } from "./recording.js";
import { REPLAY } from "./words.js";

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];
/** ms between two instants, ms after a failure, ms after which the address names the instant, and s of a skip. */
const FRAME = 40, AGAIN = 1000, NAMED = 500, SKIP = 5;

const byId = (id) => document.getElementById(id);
const match = new Match();
const field = new Field(byId("field"), byId("stage"));
const panel = new Panel();
const replay = { time: 0, begin: 0, end: 0, speed: 1, playing: false, marks: [] };
let have = [], asked = null, heard = 0, lost = false, named = 0, whole = null;

const make = (tag, props) => Object.assign(document.createElement(tag), props);
const button = (words, about, act) => {
  const made = make("button", { textContent: words, title: about });
  made.addEventListener("click", act);
  return made;
};

const toggle = button("▶", REPLAY.play, () => play(!replay.playing));
const slider = make("input", { type: "range", step: 0.1, ariaLabel: REPLAY.time });
const speed = make("select", { ariaLabel: REPLAY.speed });
speed.append(...SPEEDS.map((value) => make("option", { value, textContent: `×${value}`, selected: value === 1 })));
const bar = make("div", { id: "replay" });
const ticks = make("div", { className: "ticks" });
const line = make("div", { className: "line" });
line.append(slider, ticks);
bar.append(button("|◀", REPLAY.before, () => call(-1)), toggle, button("▶|", REPLAY.next, () => call(1)), line, speed);
byId("stage").append(bar);

byId("calls").addEventListener("click", ({ target }) => {
  const mark = target.tagName === "TIME" && replay.marks.find((one) => one.number === Number(target.closest("li").dataset.number));
  if (mark) to(mark.time);
});
slider.addEventListener("input", () => to(Number(slider.value)));
speed.addEventListener("change", () => (replay.speed = Number(speed.value)));

/** Go to a match time, s. */
function to(time) {
  replay.time = Math.min(Math.max(time, replay.begin), replay.end);
}

function play(on) {
  if (on && replay.time >= replay.end) to(replay.begin);
  replay.playing = on;
}

/** Go to the next call, or to the one before. */
function call(step) {
  const times = replay.marks.map((mark) => mark.time);
  // A call that was made a moment ago is not the one before.
  const found = step > 0 ? times.find((time) => time > replay.time + 0.01) : times.findLast((time) => time < replay.time - replay.speed);
  to(found ?? (step > 0 ? replay.end : replay.begin));
}

/** The instant in the address, such as #t=83.2; null if there is none. */
function wanted() {
  const found = /^#t=(\d+(\.\d+)?)$/.exec(location.hash);
  return found ? Number(found[1]) : null;
}
window.addEventListener("hashchange", () => {
  if (wanted() === null) return;
  play(false);
  to(wanted());
});

const KEYS = {
  k: () => play(!replay.playing), pagedown: () => call(1), pageup: () => call(-1),
  arrowright: () => to(replay.time + SKIP), arrowleft: () => to(replay.time - SKIP),
  home: () => to(replay.begin), end: () => to(replay.end), l: () => showPlans(),
};
window.addEventListener("keydown", (event) => {
  const act = KEYS[event.key.toLowerCase()];
  if (!act || event.ctrlKey || event.metaKey || event.altKey || event.target === speed) return;
  // It would press the focused button, or move the slider a second time.
  event.preventDefault();
  act();
});
function showPlans() {
  match.plans = !match.showsPlans;
}
byId("plans").addEventListener("click", showPlans);

/** What the server answers to a question, or null if it does not. */
async function got(question) {
  let answer = null;
  try {
    const response = await fetch(question);
    if (response.ok) answer = await response.json();
  } catch {
    // The server is gone, or not reached.
  }
  lost = answer === null;
  return answer;
}

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Ask for the instant that is to be shown, again and again. */
async function follow() {
  let before = performance.now();
  for (;;) {
    const now = performance.now();
    if (replay.playing) {
      to(replay.time + (replay.speed * Math.min(now - before, 250)) / 1000);
      replay.playing = replay.time < replay.end;
    }
    before = now;
    const rate = replay.playing ? replay.speed : 1, question = `at?t=${replay.time.toFixed(2)}&rate=${rate}`;
    let pause = FRAME;
    if (whole) hear(whole.at(replay.time, rate));
    // Of an instant that stands it is asked again now and then, to find out whether the page is still served.
    else if (question !== asked || now - heard > AGAIN) {
      const messages = await got(`${question}&have=${have.join(",")}`);
      if (messages) {
        hear(messages);
        [asked, heard] = [question, now];
      } else pause = AGAIN;
    }
    await sleep(Math.max(0, pause - (performance.now() - now)));
  }
}

function hear(messages) {
  for (const message of messages) {
    if (message.t === "have") have = message.marks;
    // The list is whole: after going back, later calls are no longer there.
    if (message.t === "calls") match.calls = [];
    match.take(message, performance.now() / 1000);
  }
}

function draw() {
  panel.show(match);
  field.draw(match, performance.now() / 1000, "");
  toggle.textContent = replay.playing ? "❚❚" : "▶";
  toggle.title = replay.playing ? REPLAY.pause : REPLAY.play;
  slider.value = replay.time;
  say("link-words", lost ? REPLAY.lost : REPLAY.recorded(match.name));
  byId("lamp").className = lost ? "lost" : "good";
  const now = performance.now(), hash = `#t=${replay.time.toFixed(1)}`;
  // A page within another one, such as a notebook, has no address of its own.
  if (now - named > NAMED && location.hash !== hash && replay.end && location.protocol !== "about:") {
    named = now;
    history.replaceState(null, "", hash);
  }
  requestAnimationFrame(draw);
}

async function begin() {
  const own = await packed(byId("recorded"));
  whole = own && new Recording(own);
  let about = whole?.about;
  while (!(about ??= await got("match"))) await sleep(AGAIN);
  match.take(about, 0);
  Object.assign(replay, { begin: about.begin, end: about.end, marks: about.marks, playing: wanted() === null });
  [slider.min, slider.max] = [about.begin, about.end];
  to(wanted() ?? about.begin);
  document.title = `${about.match} · VRG`;
  const length = about.end - about.begin || 1;
  ticks.append(...about.marks.map(({ time, text }) => {
    const tick = make("i", { title: text });
    tick.style.left = `${(100 * (time - about.begin)) / length}%`;
    return tick;
  }));
  follow();
}

// For tests, and for whoever wants to know.
window.vrg = { match, field, replay };
begin();
requestAnimationFrame(draw);
