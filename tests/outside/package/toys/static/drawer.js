// Shows how many calls there were, and the player that was clicked.
export class Drawer {
  constructor(section, ask) {
    this.section = section;
    this.ask = ask;
    this.selected = "";
    section.id = "tally";
    section.style.gridArea = "lists";
  }

  begin() {
    this.ask(this.selected);
  }

  select(player) {
    this.selected = player;
    this.ask(player);
  }

  take({ match, count, player }) {
    this.section.textContent = `${match}: ${count} calls, ${player || "nobody"} is selected`;
  }

  get shapes() {
    return [];
  }
}
