// The drawer of the details: tables and lists about everything, for officials.
import { make, say } from "../../panel.js";

const WORDS = {
  asking: "Asking for the details …",
  disqualify: "Disqualify",
  reinstate: "Reinstate",
  filter: "Type what the rows must contain",
  /** What the headings of tables mean where that is not plain. Rates and ages are in real time. */
  columns: {
    age: "s since the newest message", Hz: "messages a second", lost: "messages that were lost since this was opened",
    "ticks/s": "ticks a second of its own loop", missed: "ticks that were skipped because an earlier one took too long",
    refused: "messages refused because they had a wrong key", ms: "how late it hears the match clock",
    ppm: "how much faster its own clock runs", "driven by": "who drives it: its program, a person, the referee, or nobody because it may not move",
  },
  tabs: { players: "Players", player: "Player", referee: "Referee", streams: "Streams", processes: "Processes" },
  layers: { scans: "Scan", sensors: "Other sensors", sightings: "Sightings", measured: "Measured" },
};
/** The parts of the drawer, before words and rows are put into them. */
const PARTS = `
  <div id="tabs"></div>
  <div id="layers"></div>
  <p id="details-note"></p>
  <div id="on-player"><button id="disqualify" data-act="disqualify"></button><button id="reinstate" data-act="reinstate"></button></div>
  <input id="filter" type="search">
  <div id="sheet">
    <p id="sheet-note"></p>
    <table id="table"><thead></thead><tbody></tbody></table>
  </div>`;

const style = Object.assign(make("link"), { rel: "stylesheet", href: new URL("drawer.css", import.meta.url) });
await new Promise((done) => {
  style.onload = style.onerror = done;
  document.head.append(style);
});

const byId = (id) => document.getElementById(id);

/** The value of a number such as 12, 0.5 or 7%, also with words behind it, or NaN for another text. */
const number = (text) => (/^[+-]?[\d.]+%?( |$)/.test(text) ? parseFloat(text) : NaN);

/** Whether a column of a table has numbers, and no other text with a digit. */
const isNumeric = ({ rows }, at) => {
  const digits = rows.map(([, cells]) => cells[at][0]).filter((text) => /\d/.test(text));
  return digits.length > 0 && digits.every((text) => Number.isFinite(number(text)));
};

/** The rows of a table that have a text, sorted by a column: `sort` is [heading, whether it is turned round], or null.
 *  Numbers come from the highest, texts from A to Z. */
export function arranged(table, { filter, sort }) {
  const wanted = filter.toLowerCase();
  const found = table.rows.filter(([, cells]) => cells.some(([text]) => text.toLowerCase().includes(wanted)));
  if (!sort) return found;
  const at = table.columns.indexOf(sort[0]), numeric = isNumeric(table, at), sign = numeric === sort[1] ? 1 : -1;
  return found.sort(([, a], [, b]) => {
    const [x, y] = [a[at][0], b[at][0]], apart = numeric ? number(x) - number(y) : NaN;
    return sign * (Number.isFinite(apart) ? apart : x.localeCompare(y, "en", { numeric: true }));
  });
}

/** What a click on a heading makes of a sort: by it, then the other way round, then as the server has sorted. */
export const resorted = (sort, heading) => (sort?.[0] !== heading ? [heading, false] : sort[1] ? null : [heading, true]);

export class Drawer {
  /** Fill a section of the page; `ask(player)` tells the server whose details are wanted. */
  constructor(section, ask) {
    section.id = "details";
    section.innerHTML = PARTS;
    this.ask = ask;
    this.selected = "";
    this.tab = "players";
    /** What each tab is filtered by and sorted by. */
    this.views = Object.fromEntries(Object.keys(WORDS.tabs).map((tab) => [tab, { filter: "", sort: null }]));
    this.layers = new Set(Object.keys(WORDS.layers).filter((layer) => layer !== "sensors"));
    this.data = null;
    for (const id of ["disqualify", "reinstate"]) say(id, WORDS[id]);
    byId("filter").placeholder = WORDS.filter;
    byId("filter").addEventListener("input", ({ target }) => {
      this.views[this.tab].filter = target.value;
      this.show();
    });
    byId("table").addEventListener("click", ({ target }) => {
      const heading = target.dataset.heading, name = target.closest("tr")?.dataset.name, view = this.views[this.tab];
      if (heading) view.sort = resorted(view.sort, heading);
      if (heading) this.show();
      else if (name) this.select(name);
    });
    byId("tabs").append(...Object.entries(WORDS.tabs).map(([tab, words]) => {
      const button = make("button", "", words);
      button.dataset.tab = tab;
      button.addEventListener("click", () => this.turn(tab));
      return button;
    }));
    byId("layers").append(...Object.entries(WORDS.layers).map(([layer, words]) => {
      const box = make("input");
      box.type = "checkbox";
      box.checked = this.layers.has(layer);
      box.addEventListener("change", () => this.layers[box.checked ? "add" : "delete"](layer));
      return make("label", "", "", box, words);
    }));
  }

  /** It was opened, or the page has a new connection. */
  begin() {
    this.data = null; // the link may lead to another match by now
    this.ask(this.selected);
    this.show();
  }

  /** Show a player, wherever it was clicked. */
  select(player) {
    this.selected = player;
    this.turn("player");
    this.ask(player);
  }

  turn(tab) {
    this.tab = tab;
    byId("filter").value = this.views[tab].filter;
    byId("sheet").scrollTop = 0;
    this.show();
  }

  take(data) {
    this.data = data;
    this.show();
  }

  /** What the field shows besides. */
  get shapes() {
    return [...this.layers].flatMap((layer) => this.data?.layers[layer] ?? []);
  }

  show() {
    const { data, tab, selected } = this, table = data?.tabs[tab] ?? { columns: [], rows: [], note: "" }, view = this.views[tab];
    const known = data?.selected === selected && selected;
    for (const button of byId("tabs").children) button.setAttribute("aria-pressed", button.dataset.tab === tab);
    byId("on-player").hidden = tab !== "player";
    byId("disqualify").disabled = !known || data.out;
    byId("reinstate").disabled = !known || !data.out;
    for (const button of byId("on-player").children) button.dataset.player = selected;
    say("details-note", data ? data.note : WORDS.asking);
    say("sheet-note", table.note);
    const [head] = fitted(byId("table").tHead, 1, "tr");
    fitted(head, table.columns.length, "th").forEach((heading, at) => {
      heading.dataset.heading = table.columns[at];
      heading.title = WORDS.columns[table.columns[at]] ?? "";
      const sign = view.sort?.[0] === table.columns[at] ? (view.sort[1] ? " ▴" : " ▾") : "";
      write(heading, table.columns[at] + sign, isNumeric(table, at) ? "number" : "");
    });
    const rows = arranged(table, view);
    fitted(byId("table").tBodies[0], rows.length, "tr").forEach((line, index) => {
      const [name, cells] = rows[index], part = cells.length === 1;
      line.dataset.name = name;
      line.className = part ? "part" : name && name === selected ? "own" : "";
      fitted(line, cells.length, "td").forEach((cell, at) => {
        const [text, tone] = cells[at];
        cell.colSpan = part ? 2 : 1;
        write(cell, text, tone + (head.children.length && Number.isFinite(number(text)) ? " number" : ""));
      });
    });
  }
}

/** The children of an element, as many as there shall be. What is there stays, so that it can be clicked meanwhile. */
function fitted(parent, count, tag) {
  while (parent.children.length > count) parent.lastChild.remove();
  while (parent.children.length < count) parent.append(make(tag));
  return [...parent.children];
}

function write(cell, text, name) {
  if (cell.textContent !== text) cell.textContent = text;
  cell.className = name;
}
