// The officials' page of an event: what is on, what may be decided now, and corrections of results and titles.
import { ask, keptToken } from "./class_server.js";
import { fill, words } from "./day_words.js";
import { byId, clock, follow, headingOf, ranking, renew, row, scoreOf, soon, statusOf, titleOf, wonBy } from "./event_parts.js";
import { make, say } from "./panel.js";

const SURE = 4000, TOLD = 6000, token = keptToken("vrg-event");
let refused = "", told = 0, sure = 0, saved = null;
/** Have something done; what is refused is said in words. Returns whether it was done. */
async function act(what, about = {}) {
  const done = ask("act", token, { act: what, ...about }, soon());
  refused = await done.then(() => "", ({ status, message }) => (status ? message : words("event.not_sent")));
  clearTimeout(told);
  told = setTimeout(() => (refused = ""), TOLD);
  return !refused;
}

function show(state, left, lost) {
  const { title, matches, n, phase, held, live, seats } = state, match = matches[n - 1], on = phase === "ready" || phase === "running";
  document.title = title;
  say("title", title);
  say("status", [refused, statusOf(state, lost)].filter(Boolean).join(" "));
  say("what", headingOf(state));
  say("who", match ? titleOf(match) : "");
  const scores = on && live ? [...live.scores.map(([team, points]) => `${team} ${points}`), live.words, live.clock] : phase === "review" ? [scoreOf(match), wonBy(match)] : [];
  say("score", scores.filter(Boolean).join(" · "));
  say("waiting", on ? (live ? live.waiting.join("\n") : words("event.starting")) : phase === "review" && left === null ? words("event.needs_you") : "");
  const confirms = phase === "review" && left !== null ? words("event.confirmed_in", { time: clock(left) }) : "";
  say("countdown", held || left === null ? "" : confirms || (left > 0 ? clock(left) : words("event.soon")));
  byId("begin").disabled = phase !== "waiting";
  byId("confirm").disabled = phase !== "review";
  byId("stop").disabled = !on || state.stopping;
  byId("hold").dataset.act = held ? "go on" : "hold";
  say("hold", words(held ? "event.act.go_on" : "event.act.hold"));
  say("stop", words(`event.act.${state.stopping ? "stopping" : performance.now() < sure ? "sure" : "stop"}`));
  byId("open").hidden = !on || !live;
  byId("open").href = `match/#${token}`;
  byId("seats").hidden = !seats;
  renew("links", seats, () => Object.entries(seats ?? {}).map(([player, seat]) =>
    Object.assign(make("a", "button", player), { href: `match/#${seat}`, target: "_blank", rel: "noopener" })));
  byId("table").hidden = !state.ranking.length;
  renew("ranking", state.version, () => ranking(state));
  renew("matches", [state.version, on], () => matches.filter((one) => one.state !== "unneeded").map((one) => row(one, decisions(one, on))));
}

/** The buttons of a match. */
function decisions(match, on) {
  const button = (name, does) => {
    const made = make("button", "small", words(`event.act.${name}`));
    made.addEventListener("click", does);
    return made;
  };
  const cell = make("td", "decide", "", button("title", () => askTitle(match)));
  if (match.score) cell.append(button("correct", () => askScore(match)));
  if (match.score && !on) cell.append(button("again", () => askAgain(match)));
  return cell;
}

/** Ask for something in a dialog; `fields` have names and elements, `save(values)` returns whether it was done. */
function openDialog(title, fields, save, button = "event.save") {
  say("dialog-title", title);
  say("save", words(button));
  say("dialog-status", "");
  byId("fields").replaceChildren(...fields.map(([name, element]) => make("label", "", name, element)));
  saved = save;
  byId("dialog").showModal();
}

const input = (value, more = {}) => Object.assign(document.createElement("input"), { value, ...more });

function askTitle(match) {
  const text = input(match.title ?? "", { maxLength: 100 });
  openDialog(words("event.ask_title", match), [[words("event.title"), text]], () => act("title", { n: match.n, title: text.value }));
}

function askAgain(match) {
  openDialog(words("event.ask_again", { n: match.n, title: titleOf(match) }), [], () => act("again", { n: match.n }), "event.act.again");
}

function askScore(match) {
  const names = match.score.map(([side]) => (match.who.length ? match.who[match.sides.indexOf(side)].name : side));
  const points = match.score.map(([, own]) => input(own, { type: "number", required: true, step: 1 }));
  const winner = make("select", "", "", ...[...match.score.map(([side], index) => [side, names[index]]), ["draw", words("event.draw")]]
    .map(([side, name]) => Object.assign(make("option", "", name), { value: side, selected: side === match.winner })));
  for (const one of points) one.addEventListener("input", () => {
    const found = points.map(({ valueAsNumber }) => valueAsNumber), best = Math.max(...found), first = found.indexOf(best);
    winner.value = found.lastIndexOf(best) === first ? match.score[first][0] : "draw";
  });
  const reason = input("", { required: true, maxLength: 200 });
  const fields = [...names.map((name, index) => [name, points[index]]), [words("event.winner"), winner], [words("event.reason"), reason]];
  openDialog(words("event.ask_score", { n: match.n, title: titleOf(match) }), fields, () => {
    const score = Object.fromEntries(match.score.map(([side], index) => [side, Math.round(points[index].valueAsNumber)]));
    return act("correct", { n: match.n, score, winner: winner.value, reason: reason.value });
  });
}

fill();
byId("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  if (await saved()) byId("dialog").close();
  else say("dialog-status", refused);
});
byId("cancel").addEventListener("click", () => byId("dialog").close());
byId("acts").addEventListener("click", ({ target }) => {
  if (target.id === "stop") {
    if (performance.now() < sure) act("stop");
    sure = performance.now() < sure ? 0 : performance.now() + SURE;
  } else if (target.dataset.act) act(target.dataset.act);
});
if (token) follow(show, token);
else say("status", words("event.no_link"));
