// The welcome page and the configurator: it shows what the server tells, and holds nothing but what is being typed.
import { Plan } from "./edit_field.js";
import { badge } from "./figures.js";

/** ms without another sign after which what is typed is taken in and checked. */
const PAUSE = 250;

const byId = (id) => document.getElementById(id);
const plan = new Plan(byId("field"), (player, [x, y, heading]) => ask({ do: "place", player, x, y, heading }), choose);
let token = "", told = {}, start = {}, chosen = {}, ended = false;
let marked = new Set(), columns = [];
let queue = Promise.resolve(), waiting = 0, typing = 0;
/** What is typed and not yet answered, and what of it was sent, by the keys of fields. */
const pending = new Map(), sent = new Map();

function make(tag, name = "", text = "", ...children) {
  const element = document.createElement(tag);
  if (name) element.className = name;
  if (text) element.textContent = text;
  element.append(...children);
  return element;
}

// Talking to the server, one request after the other

async function post(path, body, bearer) {
  const answer = await fetch(path, { method: "POST", headers: { Authorization: `Bearer ${bearer}` }, body });
  if (!answer.ok) throw new Error(await answer.text());
  return answer;
}

function send(request) {
  waiting += 1;
  queue = queue.then(async () => {
    waiting -= 1;
    if (ended) return;
    let answer = null;
    try {
      answer = await (await post("edit", JSON.stringify("seen" in request ? { ...request, seen: told.number } : request), token)).json();
    } catch (error) {
      tell(error instanceof TypeError ? "The configurator was ended in its terminal, which names the file with the changes that were not saved." : error.message);
    }
    if (request.do === "place") plan.waits -= 1;
    if (answer) hear(answer, request);
    // Whatever has changed the match, it is checked once nothing else is asked for. A check that fails is not repeated.
    if (!ended && !waiting && told.checked === false && (answer || request.do !== "check")) send({ do: "check" });
  });
}

/** Ask for a change of the match. */
function ask(request) {
  takeIn();
  send({ ...request, seen: 0 });
}

/** Take in what is being typed now. */
function takeIn() {
  clearTimeout(typing);
  for (const [key, typed] of pending) {
    if (sent.get(key) === typed) continue;
    sent.set(key, typed);
    send({ do: "set", key, typed, seen: 0 });
  }
}

function hear(answer, request) {
  told = answer;
  if (request.do === "set" && sent.get(request.key) === request.typed) sent.delete(request.key);
  if (request.do === "set" && pending.get(request.key) === request.typed) pending.delete(request.key);
  if (answer.start) begin(answer);
  if (request.do !== "check" || answer.notice) tell(answer.notice);
  if (answer.ended) return end(request);
  show();
  if (answer.ask) question(answer.ask, request);
  else if (request.then) request.then();
}

function tell(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = !text;
}

function end(request) {
  ended = true;
  const words = { watch: "The recording is shown in a window.", leave: "The configurator has ended." }[request.do] ?? "The match is played: see the terminal.";
  document.body.replaceChildren(make("p", "", `${words} You can close this page.`));
  document.body.firstChild.id = "end";
  sessionStorage.removeItem("editor");
  if (request.do === "save") follow();
}

/** Go to the page of the match, if it comes to be served where this page was. */
async function follow() {
  for (let tries = 0; tries < 40; tries++) {
    await new Promise((done) => setTimeout(done, 500));
    const found = await fetch("main.js").catch(() => null);
    const page = found?.ok ? await fetch("/").then((answer) => answer.text()).catch(() => "") : "";
    if (page.includes('src="main.js"')) return location.replace("/");
  }
}

// Questions, in a dialog of the browser

function question({ kind, question: words }, request) {
  const dialog = byId("ask"), named = kind === "name";
  byId("question").textContent = words;
  byId("answer").hidden = !named;
  byId("answer").value = named ? request.name || told.settings[0].value : "";
  byId("yes").textContent = named ? "Save" : "Yes";
  byId("no").textContent = named ? "Cancel" : "No";
  dialog.returnValue = "no";
  dialog.onclose = () => {
    if (dialog.returnValue !== "yes") return;
    const answer = named ? { name: byId("answer").value, replace: false } : kind === "replace" ? { replace: true } : { sure: true };
    send({ ...request, ...answer });
  };
  dialog.showModal();
}

// The start

function begin(answer) {
  start = answer.start;
  plan.match.colours = answer.colours;
  byId("count").max = answer.most;
  for (const [name, colour] of Object.entries(answer.colours)) document.documentElement.style.setProperty(`--${name}`, colour);
  byId("games").replaceChildren(
    ...start.games.map((game) => {
      const roles = game.roles.map((role) => make("span", "role", "", badge(role.sign), role.name));
      return card({ game: game.name }, make("strong", "", game.title), ...roles, make("p", "", game.about));
    }),
  );
  byId("map").replaceChildren(new Option("the game's own map", ""), ...start.maps.map((name) => new Option(name)));
  const recent = start.recent.map(({ name, game, when, ending, match, where }) =>
    card({ match }, make("strong", "", name), make("small", "", game), make("small", "", when), make("p", "", ending),
      make("small", "", where)),
  );
  byId("recent").replaceChildren(...(recent.length ? recent : [make("p", "", "none in this folder yet")]));
  if (!chosen.game && !chosen.match) chosen = { game: start.first };
  go(document.body.dataset.began ? document.body.dataset.screen : answer.begins);
  document.body.dataset.began = "yes";
}

function card(what, ...children) {
  const button = make("button", "card", "", ...children);
  button.setAttribute("role", "radio");
  Object.assign(button.dataset, what);
  button.onclick = () => open(what);
  button.ondblclick = () => byId("play").click();
  return button;
}

function open(what) {
  const map = what.match ? {} : { map: byId("map").value };
  send({ do: "open", ...what, ...map, then: () => (chosen = what) });
}

function go(screen) {
  document.body.dataset.screen = screen;
  plan.movable = screen === "edit";
}

// The form

/** An input for a field: a list where all that it can be is known, and otherwise a line to type in. */
function control(field, choices) {
  const closed = choices.length && !field.key.endsWith(".strategy");
  const input = make(closed ? "select" : "input");
  input.dataset.key = field.key;
  input.dataset.name = field.key.split(".").pop();
  input.setAttribute("aria-label", field.label);
  if (!closed) {
    input.spellcheck = false;
    input.autocomplete = "off";
    input.maxLength = 2000;
    if (choices.length) input.setAttribute("list", "strategies");
    if (["x", "y", "heading", "rate", "seed", "memory", "sight"].includes(input.dataset.name)) input.inputMode = "decimal";
  }
  input.oninput = () => {
    pending.set(field.key, input.value);
    clearTimeout(typing);
    typing = setTimeout(takeIn, closed ? 0 : PAUSE);
  };
  input.onblur = () => (takeIn(), show());
  return input;
}

/** Show the value of a field, unless a person is just typing there. */
function fill(input, field, choices) {
  if (input.tagName === "SELECT") {
    const names = new Set([...(field.value === "" || !choices.includes(field.default) ? [""] : []), ...choices, field.value]);
    if (input.dataset.names !== JSON.stringify([...names, field.default])) {
      input.dataset.names = JSON.stringify([...names, field.default]);
      input.replaceChildren(...[...names].map((name) => new Option(name || (field.default ? `(${field.default})` : "(default)"), name)));
    }
  }
  input.placeholder = field.default || (field.key.startsWith("rules.") ? "by the rules" : "");
  if (!pending.has(field.key) && document.activeElement !== input && input.value !== field.value) input.value = field.value;
  const wrong = told.problems.filter(({ fields }) => fields.includes(field.key)).map(({ text }) => text);
  input.classList.toggle("wrong", wrong.length > 0);
  input.setAttribute("aria-invalid", wrong.length > 0);
  input.title = wrong.join("\n");
  return wrong;
}

function fields(id, listed) {
  const box = byId(id), keys = JSON.stringify(listed.map(({ key }) => key));
  if (box.dataset.keys !== keys) {
    box.dataset.keys = keys;
    box.replaceChildren(...listed.map((field) => {
      const label = make("label", "field", field.label, control(field, field.choices), make("span", "why"), make("span", "help"));
      return label;
    }));
  }
  listed.forEach((field, index) => {
    const [input, why, help] = box.children[index].children;
    const wrong = fill(input, field, field.choices);
    why.textContent = wrong.join(" ");
    help.textContent = wrong.length ? "" : [field.bounds && `(${field.bounds})`, field.help].filter(Boolean).join(" ");
  });
}

function players() {
  const body = byId("table").tBodies[0], head = byId("table").tHead;
  if (JSON.stringify(columns) !== JSON.stringify(told.columns)) {
    columns = told.columns;
    body.replaceChildren();
    head.replaceChildren(make("tr", "", "", make("th"), ...columns.map(({ label }) => make("th", "", label))));
    const names = columns.find(({ name }) => name === "strategy").choices.filter(Boolean);
    const list = make("datalist", "", "", ...names.map((name) => new Option(name, name)));
    list.id = "strategies";
    byId("offers").replaceChildren(list);
  }
  while (body.children.length > 2 * told.players.length) body.lastChild.remove();
  while (body.children.length < 2 * told.players.length) body.append(...playerRows(body.children.length / 2));
  told.players.forEach((row, number) => {
    const line = body.children[2 * number], why = body.children[2 * number + 1];
    line.cells[0].lastChild.replaceWith(badge(told.styles[number]));
    line.cells[0].firstChild.checked = marked.has(number);
    line.classList.toggle("own", number === plan.chosen);
    const wrong = row.flatMap((field, index) => fill(line.cells[index + 1].firstChild, field, columns[index].choices));
    why.hidden = !wrong.length;
    why.firstChild.textContent = [...new Set(wrong)].join(" ");
  });
}

function playerRows(number) {
  const mark = make("input");
  mark.type = "checkbox";
  mark.setAttribute("aria-label", `mark player ${number + 1}`);
  mark.onchange = () => (mark.checked ? marked.add(number) : marked.delete(number), show());
  const cells = told.players[number].map((field, index) => {
    const { name, label, choices } = columns[index], cell = make("td", "", "", control({ ...field, label: `${label} of player ${number + 1}` }, choices));
    cell.dataset.name = name;
    cell.dataset.label = label;
    return cell;
  });
  const line = make("tr", "", "", make("td", "", "", mark, make("canvas")), ...cells), why = make("td", "why");
  line.addEventListener("focusin", () => plan.chosen !== number && plan.choose(number));
  why.colSpan = cells.length + 1;
  return [line, make("tr", "", "", why)];
}

function choose(player) {
  const lines = byId("table").tBodies[0].children;
  for (let number = 0; number < lines.length / 2; number++) lines[2 * number].classList.toggle("own", number === player);
  const { pose } = plan, name = told.players[player]?.[0].value;
  byId("pose").textContent = pose && plan.movable ? `${name}: x ${pose[0].toFixed(2)} m, y ${pose[1].toFixed(2)} m, ${Math.round((pose[2] * 180) / Math.PI)}°` : "";
}

function problems() {
  const { problems: found, checked } = told;
  byId("problems-heading").textContent = !checked ? "Problems: checking …" : found.length ? `Problems: ${found.length}` : "Problems: none, ready to play";
  byId("problems").replaceChildren(...found.map(({ text, line, fields: at }) => {
    const button = make("button", "", "", make("small", "", line ? `line ${line}` : ""), text);
    button.onclick = () => {
      go("edit");
      const input = at.map((key) => document.querySelector(`[data-key="${CSS.escape(key)}"]`)).find(Boolean);
      (input ?? byId("rules").querySelector("input")).focus();
      document.activeElement.scrollIntoView({ block: "center" });
    };
    return make("li", "", "", button);
  }));
  byId("play").classList.toggle("waits", found.length > 0);
}

function show() {
  const editing = document.body.dataset.screen === "edit";
  byId("title").textContent = editing ? told.title : "Virtual Robotic Games";
  byId("file").textContent = editing ? (told.file || "new match") + (told.changed ? ", not saved" : "") : "";
  byId("file").classList.toggle("changed", told.changed);
  document.title = `${editing ? told.file || told.title : "Start"} · VRG`;
  byId("undo").disabled = !told.undo;
  byId("redo").disabled = !told.redo;
  byId("play").textContent = editing ? "Play" : "Start";
  marked = new Set([...marked].filter((number) => number < told.players.length));
  byId("remove").disabled = !marked.size;
  if (document.activeElement !== byId("count")) byId("count").value = told.players.length;
  for (const button of document.querySelectorAll(".card")) {
    button.ariaChecked = String(button.dataset.game === chosen.game && button.dataset.match === chosen.match);
  }
  byId("map").disabled = Boolean(chosen.match);
  byId("watch").disabled = !start.recent?.some(({ match, recorded }) => match === chosen.match && recorded);
  if (plan.chosen !== null && plan.chosen >= told.players.length) plan.chosen = null;
  fields("settings", told.settings);
  fields("rules", told.rules);
  players();
  problems();
  plan.show(told);
  choose(plan.chosen);
}

// Buttons and keys

const count = (players) => ask({ do: "count", players });
const save = (more = {}) => {
  takeIn();
  send({ do: "save", seen: 0, ...more });
};
const acts = {
  back: () => send({ do: "open", ...chosen, ...(chosen.match ? {} : { map: byId("map").value }), then: () => (go("start"), send({ do: "look" })) }),
  undo: () => (document.activeElement.blur(), ask({ do: "undo" })),
  redo: () => (document.activeElement.blur(), ask({ do: "redo" })),
  save: () => save(),
  "save-as": () => question({ kind: "name", question: "Save under which name? The file gets this name, too." }, { do: "save", seen: 0 }),
  close: () => send({ do: "leave" }),
  more: () => count(told.players.length + 1),
  remove: () => (ask({ do: "remove", players: [...marked] }), marked.clear()),
  play: () => save({ play: true }),
  change: () => (go("edit"), show()),
  watch: () => send({ do: "watch", match: chosen.match }),
};
for (const [id, act] of Object.entries(acts)) byId(id).addEventListener("click", act);
byId("count").addEventListener("change", () => byId("count").checkValidity() && count(byId("count").valueAsNumber));
byId("map").addEventListener("change", () => open(chosen));
window.addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || byId("ask").open || document.body.dataset.screen !== "edit") return;
  const act = { z: event.shiftKey ? "redo" : "undo", y: "redo", s: "save" }[event.key.toLowerCase()];
  if (act) event.preventDefault();
  if (act) acts[act]();
});
window.addEventListener("beforeunload", (event) => !ended && (told.changed || pending.size) && event.preventDefault());

/** The token of the link, or the one that its ticket is good for. It leaves the address; a reload still has it. */
async function enter() {
  const found = location.hash.slice(1);
  if (found) {
    history.replaceState(null, "", location.pathname);
    token = await post("ticket", "", found).then((answer) => answer.text(), () => found);
    sessionStorage.setItem("editor", token);
  }
  token = sessionStorage.getItem("editor") ?? "";
  send({ do: "look" });
}

// For tests, and for whoever wants to know.
window.vrg = { plan, field: plan.field, told: () => told, idle: () => !pending.size };
enter();
