// The leaderboard, for the workshop and for the projector.
import { words } from "./day_words.js";
import { make } from "./panel.js";

const HEAD = ["place", "player", "rating", "games"];

export class Board {
  /** Stand within an element; the row of `own` is marked. */
  constructor(parent, own = "") {
    Object.assign(this, { own, shown: "" });
    const head = make("tr", "", "", ...HEAD.map((name) => make("th", name === "player" ? "name" : name, words(`student.${name}`))));
    this.body = make("tbody");
    this.table = make("table", "board", "", make("thead", "", "", head), this.body);
    this.none = make("p", "nothing", words("student.noBoard"));
    this.link = Object.assign(make("a", "games", words("student.watchGames")), { target: "_blank", rel: "noopener" });
    parent.append(this.none, this.table, this.link);
    this.show([], "");
  }

  /** Show rows, the best first, and the address of the games, where there are some. */
  show(rows, pages) {
    this.link.href = pages;
    this.link.hidden = !pages;
    const text = JSON.stringify(rows);
    if (text === this.shown) return;
    this.shown = text;
    this.none.hidden = rows.length > 0;
    this.table.hidden = !rows.length;
    this.table.style.setProperty("--rows", rows.length + 1);
    this.body.replaceChildren(...rows.map((row, index) => {
      const rise = row.climbed ?? 0, n = Math.abs(rise), climbed = make("span", rise > 0 ? "up" : "down", rise ? `${rise > 0 ? "▲" : "▼"} ${n}` : "");
      climbed.title = rise ? words(rise > 0 ? "student.climbed" : "student.fell", { n }) : "";
      const name = make("td", "name", row.name, climbed);
      const line = make("tr", row.name === this.own ? "own" : "", "", make("td", "place", row.rating === null ? "" : String(index + 1)), name);
      line.append(...["rating", "games"].map((key) => make("td", key, row[key] === null ? words(row.plays ? "student.waits" : "student.doesNotPlay") : String(row[key]))));
      if (row.name === this.own) line.ariaCurrent = "true";
      return line;
    }));
  }
}
