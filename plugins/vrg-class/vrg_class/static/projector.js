// The page for the projector: the joining link as a picture to scan, the leaderboard, and what the teacher says.
import { Board } from "./class_board.js";
import { byId, showCode, tell } from "./class_page.js";
import { ask, keptToken } from "./class_server.js";
import { fill, words } from "./day_words.js";
import { say } from "./panel.js";

const EVERY = 3000, t = (key, n) => words(`projector.${key}`, { n });
fill();
const token = keptToken("vrg-class-projector"), link = `${location.origin}/#join=${token}`;
const board = new Board(byId("standings"));

async function look() {
  try {
    const { game, rows, games, pages, message, halted, students, done } = await ask("board", token);
    say("game", game);
    board.show(rows, pages);
    say("status", halted ? t("halted") : "");
    tell("saying", message);
    say("students-here", t("students", students));
    say("steps-done", done ? t("steps", done) : "");
    say("played", games ? t("games", games) : "");
  } catch (refusal) {
    say("status", refusal.status ? refusal.message : t("lost"));
  }
  setTimeout(look, EVERY);
}

if (token) {
  ask("qr", "", { text: link }).then(({ svg }) => showCode(byId("qr"), svg));
  say("address", link);
  byId("invitation").hidden = false;
  if (["localhost", "127.0.0.1", "[::1]"].includes(location.hostname)) say("address", t("here"));
  look();
} else say("status", t("noLink"));
