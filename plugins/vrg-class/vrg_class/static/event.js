// The spectators' page of an event, for telephones: what is on, what comes, ranking, bracket and all results.
import { fill, words } from "./day_words.js";
import { bracket, byId, clock, follow, headingOf, ranking, renew, row, scoreOf, sidesOf, statusOf, titleOf, wonBy } from "./event_parts.js";
import { say } from "./panel.js";

fill();
follow((state, left, lost) => {
  const { title, matches, n, phase, live, champion } = state, match = matches[n - 1];
  document.title = title;
  say("title", title);
  say("status", statusOf(state, lost));
  say("what", lost ? "" : headingOf(state));
  say("who", match ? titleOf(match) : champion ? words("event.wins", { who: champion }) : "");
  const counted = left === null || state.held ? "" : phase === "review" ? words("event.confirmed_in", { time: clock(left) }) : left > 0 ? clock(left) : words("event.soon");
  const result = phase === "review" && match ? `${scoreOf(match)}\n${wonBy(match)}\n` : "";
  const playing = live && ["ready", "running"].includes(phase) && !lost;
  say("countdown", playing ? [live.scores.map(([, points]) => points).join(" : "), live.clock].filter(Boolean).join("\n") : result + counted);
  say("waiting", playing ? [live.words, ...live.waiting].filter(Boolean).join(" · ") : "");
  byId("watch").hidden = !playing;
  if (match) byId("watch").href = `match/?${new URLSearchParams({ name: sidesOf(match) })}`;
  renew("ranking", state.version, () => ranking(state));
  renew("bracket", [state.version, n], () => bracket(state));
  byId("table").hidden = !state.ranking.length;
  byId("tree").hidden = !matches.some(({ kind }) => kind === "bracket");
  renew("matches", state.version, () => matches.filter((one) => one.state !== "unneeded").map((one) => row(one)));
});
