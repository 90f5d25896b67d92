// Draws the field. What stands still is drawn once and kept; what moves is drawn upon it in each frame.
import { angle, fit, point } from "./view.js";
import { Names } from "./names.js";
import { WORDS } from "./words.js";

const SMALLEST = 18;
const NOSE = 0.3;
/** Pixels from the middle of a robot within which a click means it. */
const FINGER = 24;
const FONT = "system-ui, 'DejaVu Sans', sans-serif";

export class Field {
  /** Draw upon a canvas that fills its parent; `whole` is the element that decides whether the field is turned. */
  constructor(canvas, whole) {
    this.canvas = canvas;
    this.whole = whole;
    this.context = canvas.getContext("2d", { alpha: false });
    this.still = document.createElement("canvas");
    this.stillOf = "";
    this.names = new Names();
    this.plates = [];
    this.robots = [];
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
    const view = fit(match.ground.box, area, whole);
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
    const signs = match.state?.legend ?? [];
    const key = JSON.stringify([view, width, height, ratio, ui, signs, match.groundNumber]);
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
    for (const region of ground.fields) {
      trace(c, view, region);
      c.fillStyle = colours.field;
      c.fill();
      grid(c, view, region, ground.box, colours.grid);
    }
    const xs = ground.zones.flatMap(({ bounds: b }) => [point(view, b[0], b[1])[0], point(view, b[2], b[3])[0]]);
    const sides = [Math.max(0, Math.min(...xs)), Math.min(width, Math.max(...xs))];
    for (const zone of ground.zones) drawZone(c, view, zone, ui);
    for (const zone of ground.zones) if (zone.words) writeZone(c, view, zone, sides, ui);
    c.strokeStyle = colours.border;
    c.lineWidth = 2.5 * ui;
    c.lineJoin = "miter";
    for (const region of ground.fields) {
      trace(c, view, region);
      c.stroke();
    }
    c.fillStyle = colours.wall;
    c.strokeStyle = colours["wall-edge"];
    c.lineWidth = Math.max(1, 1.5 * ui);
    for (const wall of ground.walls) {
      trace(c, view, wall);
      c.fill();
      c.stroke();
    }
    c.fillStyle = colours.background;
    c.fillRect(0, height - strip, width, strip);
    if (strip <= 30) return;
    // Where there is no room for all, the signs go first, then the scale, then the axes.
    const rest = width - legendWidth(c, signs, ui);
    const left = rest > scaleWidth(view, ui) ? drawScale(c, view, width, height, colours, ui, rest > scaleWidth(view, ui, true)) : 0;
    drawLegend(c, signs, width, height, left, colours, ui);
  }

  drawMoving(match, view, area, now, own, shapes, ui) {
    const c = this.context, { colours, state, motion } = match;
    const bodies = motion.at(now), latest = motion.latest;
    if (!state || !latest || bodies.length !== state.bodies.length) return;
    for (const shape of shapes) drawShape(c, view, shape, ui);
    for (const mark of state.marks) drawMark(c, view, mark);
    motion.trails.forEach((trail, index) => drawTrail(c, view, trail.points, bodies[index], state.bodies[index].colour));
    for (const stroke of match.showsPlans ? match.strokes : []) drawStroke(c, view, stroke, colours, ui);
    for (const [index, a, b, direction] of latest.ellipses ?? []) drawEllipse(c, view, bodies[index], [a, b, direction], colours, ui);
    const order = state.bodies.map((_, index) => index).sort((a, b) => state.bodies[b].out - state.bodies[a].out);
    for (const index of order) drawBody(c, view, bodies[index], state.bodies[index], colours);
    const robots = state.bodies.map((body, index) => ({ name: body.name, remark: body.remark, circle: circleOf(view, bodies[index], body) }));
    this.robots = robots;
    const mine = robots.find((robot) => robot.name === own);
    if (mine) {
      c.beginPath();
      c.arc(mine.circle.x, mine.circle.y, mine.circle.radius + 6 * ui, 0, 2 * Math.PI);
      c.strokeStyle = colours.caution;
      c.lineWidth = 2.5 * ui;
      c.stroke();
    }
    latest.objects.forEach((at, index) => drawFlag(c, point(view, ...at), Math.max(0.5 * view.scale, SMALLEST), state.objects[index]?.colour, colours));
    this.drawNames(robots, area, state, own, colours, ui);
    for (const flash of latest.flashes) drawFlash(c, view, area, flash, colours, ui);
  }

  drawNames(robots, area, state, own, colours, ui) {
    const c = this.context, size = Math.max(12, Math.round(13 * ui));
    c.font = `bold ${size}px ${FONT}`;
    const seen = robots.filter(({ circle: { x, y } }) => x > -20 && y > -20 && x < area.width + 20 && y < area.height + 20);
    const placed = this.names.place(seen, area, (text) => c.measureText(text).width, Math.round(size * 1.4));
    const inkOf = (name) => (name === own ? colours.caution : state.bodies.find((body) => body.name === name).out ? colours.muted : colours.text);
    c.lineWidth = 1;
    for (const { index, line } of placed) {
      if (!line) continue;
      const { x, y, radius } = seen[index].circle, length = Math.hypot(line[0] - x, line[1] - y);
      c.strokeStyle = inkOf(seen[index].name);
      c.globalAlpha = 0.8;
      c.beginPath();
      c.moveTo(x + ((line[0] - x) * radius) / length, y + ((line[1] - y) * radius) / length);
      c.lineTo(...line);
      c.stroke();
      c.globalAlpha = 1;
    }
    c.textAlign = "center";
    c.textBaseline = "middle";
    for (const { index, text, box } of placed) {
      c.globalAlpha = 0.67;
      c.fillStyle = colours.background;
      c.beginPath();
      c.roundRect(box.left, box.top, box.width, box.height, 6);
      c.fill();
      c.globalAlpha = 1;
      c.fillStyle = inkOf(seen[index].name);
      c.fillText(text, box.left + box.width / 2, box.top + box.height / 2 + 1);
    }
    this.plates = placed.map(({ box }) => box);
  }
}

function trace(c, view, outline) {
  c.beginPath();
  outline.forEach(([x, y], index) => (index ? c.lineTo(...point(view, x, y)) : c.moveTo(...point(view, x, y))));
  c.closePath();
}

function grid(c, view, region, box, colour) {
  c.save();
  trace(c, view, region);
  c.clip();
  c.beginPath();
  for (let x = Math.ceil(box[0]); x <= box[2]; x++) {
    c.moveTo(...point(view, x, box[1]));
    c.lineTo(...point(view, x, box[3]));
  }
  for (let y = Math.ceil(box[1]); y <= box[3]; y++) {
    c.moveTo(...point(view, box[0], y));
    c.lineTo(...point(view, box[2], y));
  }
  c.strokeStyle = colour;
  c.lineWidth = 1;
  c.stroke();
  c.restore();
}

function drawZone(c, view, zone, ui) {
  trace(c, view, zone.outline);
  c.fillStyle = zone.tint;
  c.fill();
  const [ax, ay] = point(view, zone.bounds[0], zone.bounds[1]), [bx, by] = point(view, zone.bounds[2], zone.bounds[3]);
  const left = Math.min(ax, bx), top = Math.min(ay, by), width = Math.abs(bx - ax), height = Math.abs(by - ay);
  if (zone.safe) {
    c.save();
    c.clip();
    c.beginPath();
    for (let offset = -height; offset < width; offset += Math.max(14, 18 * ui)) {
      c.moveTo(left + offset, top + height);
      c.lineTo(left + offset + height, top);
    }
    c.strokeStyle = zone.stripe;
    c.lineWidth = 2;
    c.stroke();
    c.restore();
    trace(c, view, zone.outline);
  }
  c.strokeStyle = zone.edge;
  c.lineWidth = zone.safe ? 2 : 1;
  c.stroke();
}

/** Write the name of a zone, between the left and the right end of all zones, px. */
function writeZone(c, view, zone, [first, last], ui) {
  const bottom = Math.max(point(view, zone.bounds[0], zone.bounds[1])[1], point(view, zone.bounds[2], zone.bounds[3])[1]);
  const along = zone.room.map((length) => length * view.scale);
  const [roomX, roomY] = view.turned ? [along[1], along[0]] : along;
  const smallest = Math.max(10, Math.round(12 * ui));
  let size = zone.below ? smallest : Math.round((zone.safe ? 20 : 15) * ui);
  const setFont = () => (c.font = `bold ${size}px ${FONT}`);
  setFont();
  while (size > smallest && c.measureText(zone.words).width > 0.85 * roomX) {
    size -= 1;
    setFont();
  }
  const width = c.measureText(zone.words).width, [x, y] = point(view, ...zone.middle);
  c.fillStyle = zone.ink;
  c.textAlign = "center";
  if (zone.below) {
    c.textBaseline = "top";
    c.fillText(zone.words, Math.max(first + width / 2 + 4, Math.min(last - width / 2 - 4, x)), bottom + 4 * ui);
    return;
  }
  c.textBaseline = "middle";
  const upright = width > 0.85 * roomX && roomY > roomX;
  const [long, high] = upright ? [roomY, roomX] : [roomX, roomY];
  if (width > long - 4 && zone.team) {
    // A corner has more room along its border than about its middle.
    const lines = zone.words.split(" "), step = 1.2 * size, [x0, y0, x1, y1] = zone.bounds;
    const widest = Math.max(...lines.map((line) => c.measureText(line).width));
    if (widest > (view.turned ? y1 - y0 : x1 - x0) * view.scale) return;
    lines.forEach((line, index) => c.fillText(line, x, y + (index - (lines.length - 1) / 2) * step));
    return;
  }
  if (width > long - 4 || size > high - 4) return;
  c.save();
  c.globalAlpha = zone.safe ? 0.82 : 0.6;
  c.translate(x, y);
  if (upright) c.rotate(-Math.PI / 2);
  c.fillText(zone.words, 0, 0);
  c.restore();
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
  c.font = `${Math.max(10, Math.round(12 * ui))}px ${FONT}`;
  c.textAlign = "center";
  c.textBaseline = "bottom";
  c.fillText(WORDS.metres(metres), left + length / 2, bottom - 4 * ui);
  if (!axes) return scaleWidth(view, ui);
  c.textBaseline = "middle";
  const origin = [left + length + 40 * ui, bottom - (view.turned ? 22 * ui : 0)];
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
  c.font = `${Math.max(11, Math.round(13 * ui))}px ${FONT}`;
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
    const { words, colour, marker } = signs[index];
    c.fillStyle = colour;
    c.strokeStyle = colours.text;
    c.lineWidth = 1;
    c.beginPath();
    c.roundRect(x, y - side / 2, side, side, 4);
    c.fill();
    if (marker) {
      c.save();
      c.translate(x + side / 2, y);
      c.rotate(-Math.PI / 2);
      drawMarker(c, marker, side * 0.32, colours.ink);
      c.restore();
    } else c.stroke();
    c.fillStyle = colours.text;
    c.fillText(words, x + side + 6 * ui, y);
    x += wide;
  });
}

function sizeOf(view, body) {
  const grow = Math.max(1, SMALLEST / Math.max(body.length * view.scale, 0.01));
  return [body.length * view.scale * grow, body.width * view.scale * grow];
}

function circleOf(view, [x, y], body) {
  const [px, py] = point(view, x, y), [length, width] = sizeOf(view, body);
  return { x: px, y: py, radius: Math.max(Math.hypot(length, width) / 2, length * (0.5 + NOSE)) };
}

/** The ellipse within which a body may be. */
function drawEllipse(c, view, [x, y], [a, b, direction], colours, ui) {
  c.beginPath();
  c.ellipse(...point(view, x, y), a * view.scale, b * view.scale, -angle(view, direction), 0, 2 * Math.PI);
  c.strokeStyle = colours.caution;
  c.lineWidth = 1.5 * ui;
  c.stroke();
}

function drawBody(c, view, [x, y, theta], body, colours) {
  const [length, width] = sizeOf(view, body), rim = body.physical ? 3 : 1;
  c.save();
  c.translate(...point(view, x, y));
  c.rotate(-angle(view, theta));
  c.fillStyle = body.nose;
  c.beginPath();
  c.moveTo(length / 2 + rim + NOSE * length, 0);
  c.lineTo(length / 2, -0.36 * width);
  c.lineTo(length / 2, 0.36 * width);
  c.fill();
  const corner = Math.max(2, 0.12 * width);
  c.fillStyle = body.physical ? colours.text : colours.ink;
  c.beginPath();
  c.roundRect(-length / 2 - rim, -width / 2 - rim, length + 2 * rim, width + 2 * rim, corner + rim);
  c.fill();
  c.fillStyle = body.colour;
  c.beginPath();
  c.roundRect(-length / 2, -width / 2, length, width, corner);
  c.fill();
  // A cross that is turned could be a plus.
  if (body.marker === "cross") c.rotate(angle(view, theta));
  drawMarker(c, body.marker, width * 0.33, colours.ink);
  c.restore();
}

const CORNERS = {
  triangle: [[1.3, 0], [-0.9, 0.85], [-0.9, -0.85]],
  square: [[0.8, 0.8], [0.8, -0.8], [-0.8, -0.8], [-0.8, 0.8]],
  diamond: [[1.1, 0], [0, -0.9], [-1.1, 0], [0, 0.9]],
};

/** Draw the sign of a role about the origin; ahead is to the right. */
export function drawMarker(c, marker, radius, colour) {
  c.fillStyle = c.strokeStyle = colour;
  c.beginPath();
  if (marker === "circle") {
    c.arc(0, 0, radius * 0.85, 0, 2 * Math.PI);
    c.fill();
  } else if (marker === "cross") {
    const r = radius * 0.8;
    c.lineWidth = Math.max(2, radius * 0.42);
    c.moveTo(-r, -r);
    c.lineTo(r, r);
    c.moveTo(-r, r);
    c.lineTo(r, -r);
    c.stroke();
  } else {
    for (const [a, b] of CORNERS[marker] ?? CORNERS.square) c.lineTo(a * radius, -b * radius);
    c.fill();
  }
}

function drawMark(c, view, mark) {
  const [x, y, theta] = mark.pose, half = Math.max(0.25 * view.scale, SMALLEST / 2);
  c.save();
  c.translate(...point(view, x, y));
  c.rotate(-angle(view, theta));
  c.strokeStyle = mark.colour;
  c.lineWidth = 1.5;
  c.strokeRect(-half, -half * 0.8, 2 * half, 1.6 * half);
  c.beginPath();
  c.moveTo(half, 0);
  c.lineTo(half * 1.7, 0);
  c.stroke();
  c.restore();
}

function drawTrail(c, view, points, body, colour) {
  const way = points.map(([x, y]) => point(view, x, y));
  // The newest points are ahead of the picture, which is a little behind.
  way.splice(-1, 1, point(view, body[0], body[1]));
  c.strokeStyle = colour;
  for (let index = 0; index + 1 < way.length; index++) {
    const share = (index + 1) / (way.length - 1);
    c.globalAlpha = 0.2 + 0.7 * share;
    c.lineWidth = 1 + 2 * share;
    c.beginPath();
    c.moveTo(...way[index]);
    c.lineTo(...way[index + 1]);
    c.stroke();
  }
  c.globalAlpha = 1;
}

/** Draw a shape of a layer: dots, a line, or an area. */
function drawShape(c, view, { kind, points, colour }, ui) {
  const places = points.map(([x, y]) => point(view, x, y)), half = Math.max(1, 1.2 * ui);
  c.fillStyle = c.strokeStyle = colour;
  c.lineWidth = 1.5 * ui;
  if (kind === "dots") {
    for (const [x, y] of places) c.fillRect(x - half, y - half, 2 * half, 2 * half);
    return;
  }
  c.beginPath();
  for (const place of places) c.lineTo(...place);
  if (kind === "area") c.fill();
  else c.stroke();
}

function drawStroke(c, view, stroke, colours, ui) {
  const points = stroke.points.map(([x, y]) => point(view, x, y)), last = points[points.length - 1];
  c.strokeStyle = c.fillStyle = stroke.colour;
  c.lineWidth = 1.5 * ui;
  c.beginPath();
  points.forEach((at, index) => (index ? c.lineTo(...at) : c.moveTo(...at)));
  c.stroke();
  c.beginPath();
  c.arc(...last, (points.length === 1 ? 2 : 3.5) * ui, 0, 2 * Math.PI);
  c.fill();
  if (stroke.label) {
    c.font = `${Math.max(10, Math.round(12 * ui))}px ${FONT}`;
    c.textAlign = "left";
    c.textBaseline = "middle";
    c.fillStyle = colours.text;
    c.fillText(stroke.label, last[0] + 7 * ui, last[1]);
  }
}

function drawFlag(c, [x, y], height, colour, colours) {
  c.strokeStyle = c.fillStyle = colours.border;
  c.lineWidth = Math.max(2, height * 0.08);
  c.beginPath();
  c.moveTo(x, y);
  c.lineTo(x, y - height);
  c.stroke();
  c.beginPath();
  c.arc(x, y, Math.max(2, height * 0.08), 0, 2 * Math.PI);
  c.fill();
  c.beginPath();
  c.moveTo(x, y - height);
  c.lineTo(x + 0.75 * height, y - 0.75 * height);
  c.lineTo(x, y - 0.5 * height);
  c.closePath();
  c.fillStyle = colour ?? colours.muted;
  c.fill();
  c.lineWidth = 1;
  c.stroke();
}

function drawFlash(c, view, area, [x, y, word, share], colours, ui) {
  const [px, py] = point(view, x, y);
  const radius = Math.min(Math.max(0.6 * view.scale, SMALLEST), 60 * ui) * (1 + share);
  c.globalAlpha = 1 - share;
  c.strokeStyle = c.fillStyle = colours.caution;
  for (const [width, part] of [[4, 1], [3, 0.75]]) {
    c.lineWidth = width * ui;
    c.beginPath();
    c.arc(px, py, radius * part, 0, 2 * Math.PI);
    c.stroke();
  }
  const size = Math.max(14, Math.round(18 * ui)), text = word.toUpperCase();
  c.font = `bold ${size}px ${FONT}`;
  const width = c.measureText(text).width + 12, height = size * 1.4;
  const above = py - radius - 4 * ui - height;
  const top = above < area.top ? py + radius + 4 * ui : above;
  const left = Math.max(0, Math.min(area.width - width, px - width / 2));
  c.globalAlpha = Math.min(1, 3 * (1 - share));
  c.beginPath();
  c.roundRect(left, top, width, height, 6);
  c.fill();
  c.fillStyle = colours.ink;
  c.textAlign = "center";
  c.textBaseline = "middle";
  c.fillText(text, left + width / 2, top + height / 2 + 1);
  c.globalAlpha = 1;
}
