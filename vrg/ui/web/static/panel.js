// Writes what is told in words: heading, score, players, calls, banners. It rewrites only what has changed.
import { badge } from "./figures.js";
import { KEYS, WORDS } from "./words.js";

const byId = (id) => document.getElementById(id);

/** Make an element: its class, its text, and its children. */
export function make(tag, name = "", text = "", ...children) {
  const element = document.createElement(tag);
  if (name) element.className = name;
  if (text) element.textContent = text;
  element.append(...children);
  return element;
}

/** Say a text where it differs from what stands there. */
export function say(id, text) {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
}

export class Panel {
  constructor() {
    this.shown = {};
    const query = new URLSearchParams(location.search);
    document.body.dataset.view = query.get("view") ?? "";
    /** What the match is called here, in place of its game. */
    this.name = query.get("name");
    for (const id of ["halt", "resume", "recover", "end", "release", "fast", "plans"]) say(id, WORDS[id]);
    say("give-back", WORDS.giveBack);
    for (const button of document.querySelectorAll(".estop")) button.textContent = WORDS.estop;
    say("players-heading", WORDS.players);
    say("calls-heading", WORDS.calls);
    say("door-takeover", WORDS.takeover);
  }

  /** Show the match. */
  show(match) {
    this.when("colours", match.colours, () => paint(match.colours));
    const { state } = match;
    say("title", state?.title ? this.name || state.title : WORDS.waiting);
    say("about", state?.about ?? "");
    say("count", state?.count ?? "");
    say("reason", state?.reason ?? "");
    say("drama", state?.drama ?? "");
    this.when("chips", state?.chips, () => {
      const chips = (state?.chips ?? []).map(({ words, colour, ink }) => {
        const chip = make("span", "chip", words);
        chip.style.background = colour;
        chip.style.color = ink;
        return chip;
      });
      byId("chips").replaceChildren(...chips);
    });
    this.when("scores", state?.scores, () => byId("scores").replaceChildren(...(state?.scores ?? []).map(score)));
    this.when("plans", match.showsPlans, () => (byId("plans").ariaPressed = String(match.showsPlans)));
    this.when("objects", state?.objects, () => byId("objects").replaceChildren(...(state?.objects ?? []).filter(({ words }) => words).map(thing)));
    this.when("banners", [state?.banners, match.role], () => {
      byId("banners").replaceChildren(...(state?.banners ?? []).map((told) => banner(told, match.role)));
    });
    this.when("players", [state?.players, match.looksNumber, match.player], () => {
      const rows = (state?.players ?? []).flatMap((player) => row(player, match));
      byId("players").tBodies[0].replaceChildren(...rows);
      byId("players").classList.toggle("many", rows.length > 12);
    });
    this.when("calls", match.calls.map((call) => call.number), () => {
      byId("calls").replaceChildren(...[...match.calls].reverse().map(call));
    });
    const frame = match.motion.latest;
    if (frame && state?.title) {
      say("clock", frame.clock);
      const minutes = Math.floor(frame.time / 60), seconds = (frame.time % 60).toFixed(1).padStart(4, "0");
      const notes = [frame.left || WORDS.playClock, WORDS.matchTime(`${minutes}:${seconds}`)];
      if (frame.rate !== 1) notes.push(WORDS.speed(frame.rate));
      say("notes", notes.join("\n"));
      frame.speeds.forEach((speed, index) => {
        const cell = byId("players").tBodies[0].querySelector(`[data-index="${index}"] .speed`);
        const text = speed === null ? "" : `${speed.toFixed(1)} m/s`;
        if (cell && cell.textContent !== text) cell.textContent = text;
      });
    }
  }

  /** Do something where a value differs from the last time. */
  when(name, value, act) {
    const text = JSON.stringify(value ?? null);
    if (this.shown[name] !== text) {
      this.shown[name] = text;
      act();
    }
  }
}

function paint(colours) {
  for (const [name, colour] of Object.entries(colours)) document.documentElement.style.setProperty(`--${name}`, colour);
}

function score({ team, points, words, colour, ink }) {
  const card = make("div", "score", "", make("span", "team", team), make("span", "points", String(points)));
  card.title = words;
  card.style.background = colour;
  card.style.color = ink;
  return card;
}

function thing({ words, colour, carried }) {
  const flag = make("span", "flag", "⚑");
  flag.style.color = colour;
  return make("div", carried ? "thing carried" : "thing", "", flag, words);
}

/** People touch this device: it may have no keyboard. */
const fingers = matchMedia("(pointer: coarse)").matches;

/** A step such as `2. C continues play` for those who have buttons in place of keys. */
export const buttonStep = (step) => step.replace(/^(\d+\. )?([A-Z]) .*$/, (whole, number = "", key) => {
  const button = KEYS[key.toLowerCase()];
  return button ? number + WORDS.press(WORDS[button]) : whole;
});

function banner({ heading, lines, steps, colour, ink, brief }, role) {
  const plate = make("div", brief ? "banner brief" : "banner", "", make("strong", "", heading));
  if (brief) plate.append(make("span", "", lines.join(" · ")));
  else plate.append(...lines.map((line) => make("p", "", line)));
  if (role === "official") plate.append(...steps.map((step) => make("p", "step", fingers ? buttonStep(step) : step)));
  plate.style.background = colour;
  plate.style.color = ink;
  return plate;
}

function row(player, match) {
  const index = match.state.players.indexOf(player);
  const deed = make("td", "deed", player.deed);
  deed.style.color = player.ink;
  const line = make("tr", "player", "", make("td", "sign", "", badge(match.looks.signs[index] ?? [], player.physical ? "badge physical" : "badge")), make("td", "name", player.name), deed, make("td", "speed"));
  line.dataset.index = index;
  line.classList.toggle("out", player.out);
  line.classList.toggle("faulty", Boolean(player.fault));
  line.classList.toggle("own", player.name === match.player);
  if (!player.fault) return [line];
  const fault = make("td", "fault", player.fault);
  fault.colSpan = 4;
  return [line, make("tr", "", "", fault)];
}

function call({ number, clock, text, rule, words, source, why = [] }) {
  const law = make("span", "law", rule);
  const more = [words, source && `(${source})`].filter(Boolean).join(" ");
  if (more) law.title = more;
  const told = [make("span", "text", text), law], lines = [more, ...why].map((words) => make("p", "", words));
  const body = why.length ? make("details", "", "", make("summary", "", "", ...told), ...lines) : make("div", "", "", ...told);
  const line = make("li", "", "", make("time", "", clock), body);
  line.dataset.number = number;
  return line;
}
