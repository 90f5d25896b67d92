// What the page knows of the match. Pure: it takes messages in, and draws nothing.
import { Motion } from "./motion.js";

const CALLS_KEPT = 200;

export class Match {
  constructor() {
    this.colours = { background: "#0c1016" };
    this.motion = new Motion();
    this.forget();
    this.role = "viewer";
    this.player = "";
    /** The titles of the drawers that this page may open, by name. */
    this.drawers = {};
    /** Whether what players sketch of their plans is shown; null leaves that to the game until somebody switches it. */
    this.plans = null;
  }

  /** Forget what was seen, but for the colours and the role. */
  forget() {
    this.name = "";
    this.ground = null;
    this.groundNumber = 0;
    this.looksNumber = 0;
    this.looks = { bodies: [], signs: [], marks: [], legend: [] };
    this.state = null;
    this.strokes = [];
    this.calls = [];
    this.ended = false;
    this.motion.reset();
  }

  /** Take in a message that arrived at `now`, s. Returns its kind. */
  take(message, now) {
    switch (message.t) {
      case "welcome":
        // After a reconnect the calls come again.
        this.calls = [];
        this.name = message.match;
        this.role = message.role;
        this.player = message.player;
        this.drawers = message.drawers;
        this.colours = message.colours;
        this.ended = false;
        this.motion.reset();
        break;
      case "displaced":
        this.role = "viewer";
        this.player = "";
        break;
      case "ground":
        this.ground = message;
        this.groundNumber += 1;
        break;
      case "looks":
        this.looks = message;
        this.looksNumber += 1;
        break;
      case "state":
        this.state = message;
        break;
      case "strokes":
        this.strokes = message.figures;
        break;
      case "frame":
        this.motion.take(message, now);
        break;
      case "calls": {
        const known = new Set(this.calls.map((call) => call.number));
        this.calls = [...this.calls, ...message.calls.filter((call) => !known.has(call.number))].slice(-CALLS_KEPT);
        break;
      }
      case "bye":
        this.ended = true;
        break;
    }
    return message.t;
  }

  /** What players sketch of their plans is shown. */
  get showsPlans() {
    return this.plans ?? this.state?.plans ?? false;
  }

  /** The player that this page may drive, as the state has it, or null. */
  get own() {
    return this.state?.players.find((player) => player.name === this.player) ?? null;
  }
}
