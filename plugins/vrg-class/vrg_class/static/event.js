// The page of an event: the timetable and a countdown; the page of the match while one is played.
import { make, say } from "./panel.js";

const WORDS = {
  next: "Next match", on: "Now on the field", over: "The event is over", held: "The timetable waits for the officials.",
  lost: "No connection. Trying again …", soon: "in a moment", watch: "Watch it",
  acts: { begin: "Begin now", hold: "Hold the timetable", "go on": "Go on", again: "Play the last match again" },
};
const EVERY = 1000, byId = (id) => document.getElementById(id);
/** The officials' token; a page with it stays, one without goes to the match. */
const token = location.hash.slice(1) || sessionStorage.getItem("vrg-event") || "";
if (token) sessionStorage.setItem("vrg-event", token);
if (location.hash) history.replaceState(null, "", location.pathname + location.search);
const turn = new URLSearchParams(location.search).get("turn"), here = location.port;
let state = null, offset = 0;

function show() {
  const { title, matches, playing, next, begins, held } = state, number = playing ?? next;
  const name = number === null ? "" : matches[number].title;
  say("title", title);
  document.title = title;
  say("who", name);
  say("what", playing !== null ? WORDS.on : next === null ? WORDS.over : WORDS.next);
  const left = Math.ceil(begins - (Date.now() / 1000 - offset)), two = (count) => String(count).padStart(2, "0");
  const hours = Math.floor(left / 3600), minutes = Math.floor(left / 60) % 60, seconds = two(left % 60);
  const counts = playing === null && next !== null && !held;
  say("countdown", !counts ? "" : left <= 0 ? WORDS.soon : hours ? `${hours}:${two(minutes)}:${seconds}` : `${minutes}:${seconds}`);
  say("status", held ? WORDS.held : "");
  const watch = byId("watch");
  const query = new URLSearchParams({ view: "projector", next: here, name, ...(turn && { turn }) });
  watch.hidden = playing === null;
  watch.textContent = WORDS.watch;
  watch.href = `${location.protocol}//${location.hostname}:${state.page}/?${query}`;
  byId("acts").hidden = !token;
  const hold = byId("hold");
  hold.dataset.act = held ? "go on" : "hold";
  document.querySelector("[data-act=begin]").disabled = playing !== null || next === null;
  document.querySelector("[data-act=again]").disabled = playing !== null || state.repeats || !matches.some(({ words }) => words);
  hold.disabled = number === null;
  for (const button of document.querySelectorAll("[data-act]")) button.textContent = WORDS.acts[button.dataset.act];
  const text = JSON.stringify([matches, next]);
  if (byId("matches").dataset.of === text) return;
  byId("matches").dataset.of = text;
  byId("matches").replaceChildren(...matches.map((match, index) => {
    const [first, second] = match.score;
    const score = second ? `${first[0]} ${first[1]} : ${second[1]} ${second[0]}` : match.score.flat().join(" ");
    const row = make("tr", match.on ? "on" : index === next ? "next" : "", "", make("td", "", match.at), make("td", "", match.title));
    row.append(make("td", "", score), make("td", "", match.words));
    return row;
  }));
}

async function look() {
  try {
    const found = await (await fetch("state")).json();
    offset = Date.now() / 1000 - found.now;
    const begun = found.playing !== null && found.playing !== (state?.playing ?? null);
    state = found;
    show();
    // The page of the match needs a moment to be there.
    if (begun && !token) setTimeout(() => state.playing !== null && location.assign(byId("watch").href), 4 * EVERY);
  } catch {
    say("status", WORDS.lost);
  }
  setTimeout(look, EVERY);
}

byId("acts").addEventListener("click", async ({ target }) => {
  if (!target.dataset.act) return;
  const answer = await fetch("act", { method: "POST", headers: { Authorization: `Bearer ${token}` }, body: JSON.stringify({ act: target.dataset.act }) });
  if (!answer.ok) say("status", await answer.text());
});
look();
