// The drawers that packages add to the page, for officials. One is open at most; its program is loaded when it is opened.
// A program exports a class Drawer, made of a section of the page to fill, and of a function that asks for what it shows
// of a player, or of none for an empty name. It has: begin() when it is opened or the connection is new, take(data) for
// what the server sends, select(player) for a robot that is clicked, and the properties selected (a player's name, or
// empty) and shapes (what the field shows besides).
import { make } from "./panel.js";

const byId = (id) => document.getElementById(id);

export class Drawers {
  /** `send(request)` asks the server for something. */
  constructor(send) {
    this.send = send;
    /** The name of the one that is wanted, or empty; the one that is open, or null; and all that were, by name. */
    this.name = "";
    this.open = null;
    this.made = {};
  }

  /** Offer these titles by name. The one that is open stays so, or else `wanted` is opened. */
  offer(titles, wanted = "") {
    byId("drawers").replaceChildren(...Object.entries(titles).map(([name, title]) => {
      const button = make("button", "", title);
      button.dataset.drawer = name;
      button.addEventListener("click", () => this.turn(name === this.name ? "" : name));
      return button;
    }));
    this.turn([this.name, wanted].find((name) => Object.hasOwn(titles, name)) ?? "");
  }

  /** Open the one of this name, or none for an empty name, and tell the server so. */
  async turn(name) {
    this.name = document.body.dataset.drawer = name;
    for (const button of byId("drawers").children) button.setAttribute("aria-pressed", button.dataset.drawer === name);
    if (this.open) this.open.section.hidden = true;
    this.open = null;
    if (!name) return this.send({ t: "inspect" });
    const program = await import(`./drawers/${name}/drawer.js`).catch(() => null);
    if (name !== this.name) return; // another one is wanted by now
    if (!program) return this.turn(""); // the server logs why
    const { Drawer } = program;
    this.open = this.made[name] ??= this.make(name, Drawer);
    this.open.section.hidden = false;
    this.open.begin();
  }

  /** Make one that was not opened before. */
  make(name, Drawer) {
    const section = make("section");
    byId("link").before(section);
    return Object.assign(new Drawer(section, (player) => this.send({ t: "inspect", drawer: name, player })), { section });
  }

  /** Show what the server has sent. */
  take({ drawer, data }) {
    if (drawer === this.name) this.open?.take(data);
  }
}
