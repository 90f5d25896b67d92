// Plays a try with a bar of time, at once, while the server still sends the rest of it.
import { signButton } from "./class_page.js";
import { Recording, seconds } from "./class_try.js";
import { words } from "./day_words.js";
import { make } from "./panel.js";

const SPEEDS = [1, 2, 4];
const STEP = 0.1;
/** The longest pause between two pictures that counts as played, ms: a page in the background stands still. */
const PAUSE = 250;
/** The marks below the bar, the foremost last: the colour and the height of each kind. */
const MARKS = [["print", "muted", 0.4], ["call", "caution", 0.7], ["error", "warning", 1]];

export class Player {
  /** Put the bar into an element; `onEnd()` is called when what is played has come to its end. */
  constructor(bar, onEnd) {
    Object.assign(this, { recording: new Recording(), time: 0, speed: 1, playing: false, onEnd, before: 0, drawn: "" });
    this.toggle = signButton("▶", words("student.play"), () => (this.playing ? this.to(this.time) : this.play()));
    this.slider = Object.assign(document.createElement("input"), { type: "range", min: 0, max: 0, step: STEP / 2, ariaLabel: words("student.time") });
    this.slider.addEventListener("input", () => this.to(Number(this.slider.value)));
    this.ticks = make("canvas", "ticks");
    this.clock = make("span", "clock");
    const speed = make("select", "", "", ...SPEEDS.map((value) => new Option(`×${value}`, value)));
    speed.ariaLabel = words("student.speed");
    speed.addEventListener("change", () => (this.speed = Number(speed.value)));
    bar.append(
      this.toggle, signButton("◀", words("student.back"), () => this.to(this.time - STEP)), signButton("▶▏", words("student.on"), () => this.to(this.time + STEP)),
      make("div", "line", "", this.slider, this.ticks), this.clock, speed, signButton("▶▶", words("student.toEnd"), () => this.finish()),
    );
  }

  /** Begin to play another recording; a `quiet` one stands until somebody plays it. */
  load(recording, quiet) {
    Object.assign(this, { recording, time: 0, playing: !quiet });
  }

  play() {
    if (this.over) this.time = 0;
    this.playing = true;
  }

  /** Stand at a time, s. */
  to(time) {
    this.playing = false;
    this.time = Math.min(Math.max(0, time), this.recording.last);
  }

  /** Go to the end, which is told as if it had been played. */
  finish() {
    this.to(this.recording.last);
    if (this.recording.end) this.onEnd();
  }

  /** It stands at the end of a try that has ended. */
  get over() {
    return Boolean(this.recording.end) && this.time >= this.recording.last - 1e-6;
  }

  /** Go on to `now`, ms, and draw the bar. Returns the time that is shown, s. */
  tick(now) {
    const { recording } = this;
    if (this.playing && recording.begun) {
      this.time = Math.min(this.time + (this.speed * Math.min(now - this.before, PAUSE)) / 1000, recording.last);
    }
    this.before = now;
    if (this.playing && this.over) {
      this.playing = false;
      this.onEnd();
    }
    this.draw();
    return this.time;
  }

  draw() {
    const { recording, slider, toggle } = this, [sign, about] = this.playing ? ["❚❚", words("student.pause")] : ["▶", words("student.play")];
    if (toggle.textContent !== sign) {
      toggle.textContent = sign;
      toggle.title = toggle.ariaLabel = about;
    }
    const last = String(recording.last), clock = seconds(this.time);
    if (slider.max !== last) slider.max = last;
    slider.value = this.time;
    if (this.clock.textContent !== clock) this.clock.textContent = slider.ariaValueText = clock;
    const { ticks } = this, width = ticks.clientWidth * devicePixelRatio, height = ticks.clientHeight * devicePixelRatio;
    const drawn = [recording.version, recording.marks.length, last, width].join();
    if (drawn === this.drawn || !width) return;
    Object.assign(ticks, { width, height });
    this.drawn = drawn;
    const c = ticks.getContext("2d"), style = getComputedStyle(ticks), wide = 2 * devicePixelRatio;
    for (const [kind, colour, high] of MARKS) {
      c.fillStyle = style.getPropertyValue(`--${colour}`);
      const places = recording.marks.filter((mark) => mark.kind === kind).map(({ time }) => time / (recording.last || 1));
      for (const place of places) c.fillRect(place * (width - wide), 0, wide, height * high);
    }
  }
}
