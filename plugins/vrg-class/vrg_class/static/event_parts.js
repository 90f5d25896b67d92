// What all pages of an event need: its state from the server, the time that is left, and matches in words.
import { words } from "./day_words.js";
import { make, say } from "./panel.js";

/** ms between two looks at the state, ms that the server has to answer, and ms between two looks at the clock. */
const EVERY = 1000, PATIENCE = 5000, SHOWN = 200;

export const byId = (id) => document.getElementById(id);

/** Options of a request that is given up where there is no answer in time. */
export const soon = () => ({ signal: AbortSignal.timeout?.(PATIENCE) });

/** Call `show(state, left, lost)` again and again: `left` is in s, null for none; `lost` is true without a connection. */
export function follow(show, token = "") {
  const headers = token ? { Authorization: `Bearer ${token}` } : {};
  let state = null, lost = false, until = null;
  async function look() {
    try {
      const answer = await fetch(`state?since=${state?.version ?? 0}`, { headers, ...soon() }), found = await answer.json();
      if (!answer.ok) throw found;
      state = { ...state, seats: null, ...found };
      until = found.left === null ? null : performance.now() + 1000 * found.left;
      lost = false;
    } catch (refused) {
      lost = refused?.why ?? "lost";
    }
    setTimeout(look, EVERY);
  }
  look();
  setInterval(() => {
    if (state) show(state, lost || until === null ? null : Math.max(0, (until - performance.now()) / 1000), lost);
    else if (lost) say("status", lostWords(lost));
  }, SHOWN);
}

const lostWords = (lost) => words(lost === "lost" ? "event.lost" : `refused.${lost}`);

/** What is to be said above all: there is no connection, or the event is held. */
export const statusOf = ({ held }, lost) => (lost ? lostWords(lost) : held ? words(`event.held.${held.why}`, held) : "");

/** A time in s, such as 1:05 or 1:00:00. */
export function clock(left) {
  const all = Math.ceil(left), hours = Math.floor(all / 3600), minutes = Math.floor(all / 60) % 60;
  return [...(hours ? [hours, `${minutes}`.padStart(2, "0")] : [minutes]), `${all % 60}`.padStart(2, "0")].join(":");
}

/** A team, or where it comes from, in words. */
export function who(source) {
  const [[kind, n]] = Object.entries(source);
  return source.name ?? words(`event.from.${kind}`, { n });
}

/** Who plays, or what a match is called; both where it has both. */
export const titleOf = ({ title, who: teams }) => [title, teams.map(who).join(" – ")].filter(Boolean).join(": ");

/** The title with the side for which each team plays. */
export const sidesOf = (match) => (match.who.length ? match.who.map((team, index) => `${who(team)} (${match.sides[index]})`).join(" – ") : titleOf(match));

/** A side of a match: the team that plays for it, or its own name. */
export const sideOf = (match, side) => (match.who.length ? who(match.who[match.sides.indexOf(side)] ?? { name: side }) : side[0].toUpperCase() + side.slice(1));

/** The score, in the order in which the title has the teams. */
export function scoreOf(match) {
  const { score } = match;
  if (!score) return "";
  if (match.who.length) return score.map(([, points]) => points).join(" : ");
  const told = score.map(([side, points], index) => (index === 1 && score.length === 2 ? [points, sideOf(match, side)] : [sideOf(match, side), points]));
  return told.map((one) => one.join(" ")).join(score.length === 2 ? " : " : ", ");
}

/** Why a result was corrected, and what it was before. */
export const correctionsOf = (match) => (match.corrections ?? []).map(({ reason, score }) =>
  words("event.corrected", { reason, before: scoreOf({ ...match, score: Object.entries(score) }) }));

/** Who has won, in words; empty before the end. */
export function wonBy(match) {
  if (!match.score) return "";
  if (match.sides.includes(match.winner)) return words("event.wins", { who: sideOf(match, match.winner) });
  return words(`event.${{ draw: "draw", nobody: "nobody_wins" }[match.winner] ?? "broken_off"}`);
}

/** What the field is for: the heading above the match that is on, or next. */
export const headingOf = ({ phase }) => words(`event.phase.${phase}`);
/** Put children into an element where a value differs from the last time, such as the version of the state. */
export function renew(id, value, children) {
  const text = JSON.stringify(value), element = byId(id);
  if (element.dataset.of === text) return;
  element.dataset.of = text;
  element.replaceChildren(...children());
}

/** A row of the timetable. Who has more points has won, if nothing else is said. */
export function row(match, ...more) {
  const cells = [make("td", "", `${match.n}`), make("td", "at", match.at), make("td", "who", titleOf(match))];
  const notes = correctionsOf(match).map((note) => make("p", "corrected", note));
  const state = ["confirmed", "waiting"].includes(match.state) ? "" : words(`event.state.${match.state}`);
  const own = match.score?.find(([side]) => side === match.winner), told = own && match.score.every((one) => one === own || one[1] < own[1]);
  cells.push(make("td", "score", scoreOf(match)), make("td", "end", state || (told ? "" : wonBy(match)), ...notes), ...more);
  return make("tr", match.state, "", ...cells);
}

/** The rows of the ranking, at most so many, below their heads; nothing without a ranking. */
export function ranking({ ranking: rows }, most = 500) {
  if (!rows.length) return [];
  const heads = ["place", "name", "played", "wins", "draws", "losses", "points"];
  const head = make("tr", "", "", ...heads.map((name) => make("th", name, words(`event.rank.${name}`))));
  return [head, ...rows.slice(0, most).map((one) => make("tr", "", "", ...heads.map((name) => make("td", name, `${one[name]}`))))];
}

/** The items of a list by what they have in common, in their order. */
function grouped(list, common) {
  const found = new Map();
  for (const item of list) found.set(common(item), [...(found.get(common(item)) ?? []), item]);
  return [...found.values()];
}

/** A bracket: the parts, each with its rounds, each with its pairings; nothing without one.
 *  Where it is `short`, rounds are left out that are over or far away, but for the last and the next one of each part. */
export function bracket({ matches, n: current }, short = false) {
  const pairings = grouped(matches.filter(({ kind, state }) => kind === "bracket" && state !== "unneeded"), ({ pairing }) => pairing);
  const over = (round) => round.flat().every(({ state }) => state === "confirmed"), open = (round) => !round.flat(2).some(({ who }) => who.some(({ name }) => name));
  const parts = grouped(pairings, ([{ part }]) => part);
  return parts.map((own) => {
    const rounds = grouped(own, ([{ round }]) => round), [[{ part }]] = own;
    const shown = rounds.filter((round, at) => !short || ((at === 0 || !open(rounds[at - 1])) && !(over(round) && over(rounds[at + 1] ?? [[{}]]))));
    const columns = shown.map((round) => make("div", short && round.length > 4 ? "round many" : "round", "", ...round.map((legs) => pair(legs, current))));
    const section = make("section", "part", "", ...(parts.length > 1 ? [make("h3", "", words(`event.part.${part}`))] : []), make("div", "rounds", "", ...columns));
    section.style.flexGrow = columns.length + shown.filter(({ length }) => length > 4).length;
    return section;
  });
}

function pair(legs, current) {
  const [first] = legs, played = legs.filter(({ score }) => score), on = legs.some(({ n }) => n === current);
  const lines = first.who.map((team, index) => {
    const points = played.map((leg) => leg.score[leg === first ? index : 1 - index]?.[1] ?? 0).reduce((sum, own) => sum + own, 0);
    return make("p", "", "", make("span", !team.name ? "name open" : team.name === first.pair_winner ? "name won" : "name", who(team)), make("span", "points", played.length ? `${points}` : ""));
  });
  if (first.again && !played.length) lines.push(make("p", "note", words("event.if_needed")));
  const card = make("div", on ? "pair on" : first.pair_winner ? "pair done" : "pair", "", ...lines);
  card.title = legs.map(({ n }) => n).join(", ");
  return card;
}
