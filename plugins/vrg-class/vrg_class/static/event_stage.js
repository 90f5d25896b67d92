// The page of the stage: the match while one is on the field, else what comes, results, ranking and bracket.
import { showCode } from "./class_page.js";
import { ask } from "./class_server.js";
import { fill, words } from "./day_words.js";
import { bracket, byId, clock, correctionsOf, follow, headingOf, ranking, renew, row, scoreOf, sidesOf, soon, statusOf, titleOf, wonBy } from "./event_parts.js";
import { make, say } from "./panel.js";

/** The rows of the timetable and of the ranking that have room, and ms: between two attempts to load the match; for which
 *  its last picture stays; and after which a picture that does not move is hidden. */
const ROWS = 8, RETRY = 2000, STAYS = 4000, STALE = 6000;
const HERE = ["localhost", "127.0.0.1", "[::1]"], turn = new URLSearchParams(location.search).get("turn");
let fitted = "", invited = null;

/** The page of the match in a frame. It is seen only while it has loaded and is not old. */
const frame = { element: null, good: false, of: "", heard: 0 };

function load(of, name) {
  unload();
  const query = new URLSearchParams({ view: "projector", name, ...(turn && { turn }) });
  const element = Object.assign(make("iframe"), { src: `match/?${query}`, title: name });
  element.addEventListener("load", () => {
    if (frame.element !== element) return;
    try {
      frame.good = element.contentDocument.getElementById("field") !== null;
    } catch {
      frame.good = false; // the browser's own page about what it could not load
    }
    if (!frame.good) setTimeout(() => frame.element === element && load(of, name), RETRY);
  });
  Object.assign(frame, { element, of });
  byId("field").replaceChildren(element);
}

const unload = () => (frame.element?.remove(), Object.assign(frame, { element: null, good: false, of: "" }));

function showMatch({ n, phase, live }, name, lost) {
  const now = performance.now(), on = phase === "ready" || phase === "running", of = `${n} ${name}`;
  if (live && !lost) frame.heard = now;
  if (on && live && frame.of !== of) load(of, name);
  const seen = frame.good && now - frame.heard < (on ? STALE : STAYS);
  if (frame.element && !on && !seen && !lost) unload();
  byId("field").classList.toggle("seen", seen);
  document.body.classList.toggle("plays", seen);
}

/** Show the code of the spectators' page, for telephones; they do not reach the name that a computer has for itself. */
function invite(link) {
  if (invited === link) return;
  invited = link;
  say("address", link || words("event.here"));
  byId("scan").hidden = !link;
  if (!link) return;
  const asked = ask("qr", "", { text: link }, soon());
  asked.then(({ svg }) => showCode(byId("code"), svg), () => setTimeout(() => (invited = null), RETRY));
}

/** Leave out the rows that have no room, and make the bracket as small as it must be. */
function fit() {
  for (const line of document.querySelectorAll("#below tr")) line.hidden = false;
  for (const table of document.querySelectorAll("#below tbody, #below table.ranking")) {
    let rows = [...table.querySelectorAll("tr")];
    // Those of long ago go first, then those that are far away.
    while (rows.length > 1 && rows.at(-1).getBoundingClientRect().bottom > innerHeight) {
      const gone = rows[0].classList.contains("confirmed") ? rows[0] : rows.at(-1);
      gone.hidden = true;
      rows = rows.filter((row) => row !== gone);
    }
  }
  const side = byId("side");
  for (let size = 1; size > 0.35; size *= 0.93) {
    side.style.fontSize = `${size}rem`;
    if (side.scrollHeight <= side.clientHeight) break;
  }
}

fill();
follow((state, left, lost) => {
  const { title, matches, n, phase, live, champion } = state, match = matches[n - 1], name = match ? titleOf(match) : "";
  document.title = title;
  say("title", title);
  say("status", document.body.classList.contains("plays") && !lost ? "" : statusOf(state, lost));
  say("what", headingOf(state));
  say("who", match ? name : champion ? words("event.wins", { who: champion }) : "");
  say("score", phase === "review" && match ? scoreOf(match) : "");
  const won = phase === "review" && match ? wonBy(match) : "";
  const confirms = phase === "review" && left !== null && !state.held ? words("event.confirmed_in", { time: clock(left) }) : "";
  say("won", [won, confirms].filter(Boolean).join(" · "));
  const counts = phase === "waiting" && left !== null && !state.held;
  say("countdown", !counts ? "" : left > 0 ? clock(left) : words("event.soon"));
  say("waiting", phase === "review" && match ? correctionsOf(match).join("\n") : !lost && live && phase === "ready" ? live.waiting.join(" · ") : "");
  showMatch(state, match ? sidesOf(match) : "", lost);
  renew("matches", [state.version, n], () => {
    const shown = matches.filter((one) => one.state !== "unneeded"), at = match ? shown.indexOf(match) : shown.length;
    const first = Math.max(0, Math.min(at - 3, shown.length - ROWS));
    return shown.slice(first, first + ROWS).map((one) => row(one));
  });
  const tree = (match?.kind ?? matches.at(-1).kind) === "bracket";
  renew("side", [tree, state.version, n], () => (tree ? bracket(state, true) : [make("table", "ranking", "", ...ranking(state, ROWS))]));
  document.body.dataset.side = tree ? "tree" : state.ranking.length ? "table" : "";
  invite(HERE.includes(location.hostname) ? state.link : new URL(".", location.href).href);
  const shape = [innerWidth, innerHeight, byId("coming").clientHeight, byId("matches").dataset.of, byId("side").dataset.of].join();
  if (shape !== fitted) fit();
  fitted = shape;
});
