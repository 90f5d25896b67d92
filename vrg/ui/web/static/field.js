// Draws the field. What stands still is drawn once and kept; what moves is drawn upon it in each frame.
import { css, drawFigure, drawShape, drawSign, frameOf, setFont } from "./figures.js";
import { Placer } from "./labels.js";
import { angle, asked, fit } from "./view.js";
import { WORDS } from "./words.js";

/** Pixels from the middle of a robot within which a click means it. */
const FINGER = 24;

export class Field {
  /** Draw upon a canvas that fills its parent; `whole` is the element that decides whether the field is turned. */
  constructor(canvas, whole) {
    this.canvas = canvas;
    this.whole = whole;
    this.context = canvas.getContext("2d", { alpha: false });
    this.still = document.createElement("canvas");
    this.stillOf = "";
    this.placer = new Placer();
    this.quarters = asked(location.search);
    /** The names of robots as they are placed, and the robots. */
    this.plates = [];
    this.robots = [];
    /** Where the names of zones are painted. */
    this.painted = [];
  }

  /** The name of the robot at a pixel, or undefined. */
  robotAt(px, py) {
    const apart = ({ circle: { x, y } }) => Math.hypot(x - px, y - py);
    return this.robots.filter((robot) => apart(robot) <= Math.max(FINGER, robot.circle.radius)).sort((a, b) => apart(a) - apart(b))[0]?.name;
  }

  /** Draw what the match looks like at `now`, s. `own` is the player with a ring, or empty; `shapes` lie below robots. */
  draw(match, now, own, shapes = []) {
    const parent = this.canvas.parentElement, ratio = window.devicePixelRatio || 1;
    const width = parent.clientWidth, height = parent.clientHeight;
    if (!width || !height) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const ui = Math.max(0.8, parseFloat(getComputedStyle(document.documentElement).fontSize) / 14.4);
    const strip = Math.round(Math.min(50 * ui, height * 0.12));
    const colours = match.colours, context = this.context;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = colours.background;
    context.fillRect(0, 0, width, height);
    if (!match.ground) return;
    const area = { left: 0, top: 0, width, height: Math.max(1, height - strip) };
    const whole = { left: 0, top: 0, width: this.whole.clientWidth, height: Math.max(1, this.whole.clientHeight - strip) };
    const view = fit(match.ground.box, area, whole, this.quarters);
    this.drawStill(match, view, width, height, strip, ratio, ui);
    context.drawImage(this.still, 0, 0, width, height);
    context.save();
    context.beginPath();
    context.rect(0, 0, width, area.height);
    context.clip();
    this.drawMoving(match, view, area, now, own, shapes, ui);
    context.restore();
    this.view = view;
  }

  drawStill(match, view, width, height, strip, ratio, ui) {
    const signs = match.looks.legend;
    const key = JSON.stringify([view, width, height, ratio, ui, match.looksNumber, match.groundNumber]);
    if (key === this.stillOf) return;
    this.stillOf = key;
    const [x0, y0, x1, y1] = match.ground.box, share = (y1 - y0) / (x1 - x0);
    document.body.style.setProperty("--field-share", Math.min(share, 1 / share)); // of its height in its width, lying
    this.still.width = this.canvas.width;
    this.still.height = this.canvas.height;
    const c = this.still.getContext("2d", { alpha: false }), { ground, colours } = match;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.fillStyle = colours.background;
    c.fillRect(0, 0, width, height);
    this.painted = ground.figures.map((figure) => drawFigure(c, view, figure, ui)).filter(Boolean);
    c.fillStyle = colours.background;
    c.fillRect(0, height - strip, width, strip);
    if (strip <= 30) return;
    // Where there is no room for all, the signs go first, then the scale, then the axes.
    const rest = width - legendWidth(c, signs, ui);
    const left = rest > scaleWidth(view, ui) ? drawScale(c, view, width, height, colours, ui, rest > scaleWidth(view, ui, true)) : 0;
    drawLegend(c, signs, width, height, left, colours, ui);
  }

  drawMoving(match, view, area, now, own, shapes, ui) {
    const c = this.context, { colours, looks, state, motion } = match;
    const bodies = motion.at(now), latest = motion.latest;
    if (!state || !latest || bodies.length !== looks.bodies.length) return;
    const field = frameOf(view, {}, ui), poses = bodies.map(([x, y, theta]) => ({ x, y, theta })), found = [];
    const add = (name, figure, at = figure.at) => {
      drawFigure(c, view, figure, ui, at);
      const { left, top, scale } = frameOf(view, figure, ui, at);
      if (figure.label) found.unshift({ name, label: figure.label, circle: { x: left, y: top, radius: (figure.label.reach ?? 0) * scale } });
    };
    for (const shape of shapes) drawShape(c, field, shape, ui);
    for (const mark of looks.marks) drawFigure(c, view, mark, ui);
    motion.trails.forEach(({ points }, index) => {
      // The newest points are ahead of the picture, which is a little behind.
      if (looks.bodies[index]) drawShape(c, field, { ...looks.bodies[index].trail, points: [...points.slice(0, -1), bodies[index]] }, ui);
    });
    for (const figure of match.showsPlans ? match.strokes : []) add(figure.name, figure);
    for (const [index, figure] of latest.around ?? []) drawFigure(c, view, figure, ui, { ...poses[index], theta: 0 });
    const order = looks.bodies.map((_, index) => index).sort((a, b) => looks.bodies[b].out - looks.bodies[a].out);
    for (const index of order) add(looks.bodies[index].name, looks.bodies[index].figure, poses[index]);
    this.robots = looks.bodies.map(({ name }) => found.find((one) => one.name === name));
    const mine = looks.bodies.findIndex(({ name }) => name === own);
    if (mine >= 0) {
      drawFigure(c, view, looks.bodies[mine].ring, ui, poses[mine]);
      const named = found.find(({ name }) => name === own);
      named.label = { ...named.label, ink: colours.caution };
    }
    const flags = latest.objects.map(([x, y, theta], index) => {
      const figure = state.objects[index]?.figure ?? {}, at = { x, y, theta }, { left, top, scale } = frameOf(view, figure, ui, at);
      drawFigure(c, view, figure, ui, at);
      const side = (figure.clear ?? 0) * scale;
      return { left: left - 2, top: top - side, width: side + 2, height: side + 2 };
    });
    for (const figure of latest.flashes) add(figure.name, figure);
    this.write(found, [...this.painted, ...flags], area, colours, ui);
  }

  /** Write the words beside figures, and not upon the boxes that are taken. */
  write(found, taken, area, colours, ui) {
    const c = this.context, sizeOf = ({ size = 13 }) => Math.max(11, Math.round(size * ui));
    const seen = found.filter(({ circle: { x, y } }) => x > -20 && y > -20 && x < area.width + 20 && y < area.height + 20);
    const placed = this.placer.place(seen, area, (text, label) => {
      setFont(c, sizeOf(label), label.bold);
      return [c.measureText(text).width, Math.round(1.4 * sizeOf(label))];
    }, taken);
    c.lineWidth = 1;
    for (const { line, label } of placed) {
      if (!line) continue;
      c.strokeStyle = css(label.ink);
      c.globalAlpha = 0.8;
      c.beginPath();
      for (const end of line) c.lineTo(...end);
      c.stroke();
    }
    c.textAlign = "center";
    c.textBaseline = "middle";
    for (const { label, text, box } of placed) {
      c.globalAlpha = 0.84;
      if (label.plate) {
        c.fillStyle = css(label.plate);
        c.beginPath();
        c.roundRect(box.left, box.top, box.width, box.height, 6);
        c.fill();
      }
      c.globalAlpha = 1;
      c.fillStyle = css(label.ink);
      setFont(c, sizeOf(label), label.bold);
      c.fillText(text, box.left + box.width / 2, box.top + box.height / 2 + 1);
    }
    this.plates = placed.filter(({ name }) => this.robots.some((robot) => robot.name === name)).map(({ box }) => box);
  }
}

/** The number of metres whose length is drawn. */
const scaleMetres = (view, ui) => [1, 2, 5, 10, 20, 50, 100].find((count) => count * view.scale >= 60 * ui) ?? 100;

/** How far to the right the scale reaches, px; with `axes` where x and y point, too. */
const scaleWidth = (view, ui, axes = false) => scaleMetres(view, ui) * view.scale + (axes ? 92 : 32) * ui;

/** Draw the length of some metres, and with `axes` where x and y point; returns how far to the right that reaches. */
function drawScale(c, view, width, height, colours, ui, axes) {
  const metres = scaleMetres(view, ui);
  const length = metres * view.scale, left = 18 * ui, bottom = height - 16 * ui;
  if (width < length + 140 * ui) return 0;
  c.strokeStyle = c.fillStyle = colours.muted;
  c.lineWidth = 1.5 * ui;
  c.beginPath();
  c.moveTo(left, bottom - 4 * ui);
  c.lineTo(left, bottom + 4 * ui);
  c.moveTo(left, bottom);
  c.lineTo(left + length, bottom);
  c.moveTo(left + length, bottom - 4 * ui);
  c.lineTo(left + length, bottom + 4 * ui);
  c.stroke();
  setFont(c, Math.max(10, Math.round(12 * ui)), false);
  c.textAlign = "center";
  c.textBaseline = "bottom";
  c.fillText(WORDS.metres(metres), left + length / 2, bottom - 4 * ui);
  if (!axes) return scaleWidth(view, ui);
  c.textBaseline = "middle";
  const { quarters } = view, origin = [left + length + (quarters > 1 ? 62 : 40) * ui, bottom - ([1, 2].includes(quarters) ? 22 * ui : 0)];
  for (const [theta, letter] of [[0, "x"], [Math.PI / 2, "y"]]) {
    const a = angle(view, theta), along = (ahead, aside = 0) => [
      origin[0] + (ahead * Math.cos(a) - aside * Math.sin(a)) * ui, origin[1] - (ahead * Math.sin(a) + aside * Math.cos(a)) * ui,
    ];
    c.beginPath();
    c.moveTo(...origin);
    c.lineTo(...along(15));
    c.stroke();
    c.beginPath();
    c.moveTo(...along(20));
    c.lineTo(...along(12, 3.5));
    c.lineTo(...along(12, -3.5));
    c.fill();
    c.fillText(letter, ...along(26));
  }
  return scaleWidth(view, ui, true);
}

/** The width of a sign of the legend with its words and of the gap beside it, px. */
function signWidth(c, words, ui) {
  setFont(c, Math.max(11, Math.round(13 * ui)), false);
  return c.measureText(words).width + Math.round(16 * ui) + 20 * ui;
}

/** The width of the whole legend, px. */
const legendWidth = (c, signs, ui) => signs.reduce((all, { words }) => all + signWidth(c, words, ui), 0);

/** Draw the signs of the roles, and what is grey, as far as there is room right of `left`. */
function drawLegend(c, signs, width, height, left, colours, ui) {
  const side = Math.round(16 * ui), y = height - 16 * ui;
  const widths = signs.map(({ words }) => signWidth(c, words, ui));
  const sum = () => widths.reduce((all, one) => all + one, 0);
  while (widths.length && sum() > width - left) widths.pop();
  c.textAlign = "left";
  c.textBaseline = "middle";
  let x = width - sum();
  widths.forEach((wide, index) => {
    drawSign(c, signs[index].sign, x + side / 2, y, side, ui);
    c.fillStyle = colours.text;
    c.fillText(signs[index].words, x + side + 6 * ui, y);
    x += wide;
  });
}
