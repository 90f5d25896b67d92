// The page for the projector: the joining link as a picture to scan, the leaderboard, and what the teacher says.
import { Board } from "./class_board.js";
import { byId, tell } from "./class_page.js";
import { ask, keptToken } from "./class_server.js";
import { PROJECTOR } from "./class_words.js";
import { say } from "./panel.js";

const EVERY = 3000;
const token = keptToken("vrg-class-projector"), link = `${location.origin}/#join=${token}`;
const board = new Board(byId("standings"));

async function look() {
  try {
    const { game, rows, games, pages, message, halted, students, done } = await ask("board", token);
    say("game", game);
    board.show(rows, pages);
    say("status", halted ? PROJECTOR.halted : "");
    tell("saying", message);
    say("students-here", PROJECTOR.students(students));
    say("steps-done", done ? PROJECTOR.steps(done) : "");
    say("played", games ? PROJECTOR.games(games) : "");
  } catch (refusal) {
    say("status", refusal.status ? refusal.message : PROJECTOR.lost);
  }
  setTimeout(look, EVERY);
}

if (token) {
  byId("qr").src = `qr.svg?text=${encodeURIComponent(link)}`;
  say("address", link);
  byId("invitation").hidden = false;
  if (["localhost", "127.0.0.1", "[::1]"].includes(location.hostname)) say("address", PROJECTOR.here);
  look();
} else say("status", PROJECTOR.noLink);
