// Draws figures, which are shapes in metres with colours, as the server sends them: see vrg/figures.py.
import { angle, point } from "./view.js";

const FONT = "system-ui, 'DejaVu Sans', sans-serif";
/** Pixels; words with smaller letters are left out. */
const LEGIBLE = 9;

export const css = (colour) => (typeof colour === "string" ? colour : `rgb(${colour})`);

export function setFont(c, size, bold = true) {
  c.font = `${bold ? "bold " : ""}${size}px ${FONT}`;
}

/** Where the points of a figure are that is at {x, y, theta}; without a place its points are those of the field. */
export function frameOf(view, { least = 0, most = Infinity }, ui, at) {
  const field = ([x, y]) => point(view, x, y);
  if (!at) return { scale: view.scale, turned: field, still: field };
  const scale = Math.min(Math.max(view.scale, least), most * ui), [left, top] = field([at.x, at.y]);
  const a = angle(view, at.theta), c = scale * Math.cos(a), s = scale * Math.sin(a);
  const turned = ([x, y]) => [left + x * c - y * s, top - x * s - y * c];
  return { scale, left, top, turned, still: ([x, y]) => [left + x * scale, top - y * scale] };
}

/** Returns the box of the words that are painted with the figure, if there are any. */
export function drawFigure(c, view, figure, ui, at = figure.at) {
  const frame = frameOf(view, figure, ui, at);
  for (const shape of figure.shapes ?? []) drawShape(c, frame, shape, ui);
  return figure.writing && paint(c, view, figure.writing, ui);
}

export function drawShape(c, frame, shape, ui) {
  const places = shape.points.map(shape.still ? frame.still : frame.turned);
  if (shape.faded) return drawFaded(c, places, shape);
  c.beginPath();
  if (shape.radius) {
    const radius = Math.max(1, shape.radius * frame.scale);
    for (const [x, y] of places) {
      c.moveTo(x + radius, y);
      c.arc(x, y, radius, 0, 2 * Math.PI);
    }
  } else {
    for (const place of places) c.lineTo(...place);
    if (shape.closed !== false) c.closePath();
  }
  if (shape.fill) {
    c.fillStyle = css(shape.fill);
    c.fill();
  }
  if (!shape.line) return;
  c.strokeStyle = css(shape.line);
  c.lineWidth = Math.max(1, (shape.width ?? 1) * ui);
  c.stroke();
}

/** A line that begins thin and in another colour. */
function drawFaded(c, places, { faded, line, width = 1 }) {
  for (let index = 0; index + 1 < places.length; index++) {
    const share = (index + 1) / (places.length - 1);
    c.strokeStyle = css(line.map((part, at) => Math.round(faded[at] + share * (part - faded[at]))));
    c.lineWidth = (0.3 + 0.7 * share) * width;
    c.beginPath();
    c.moveTo(...places[index]);
    c.lineTo(...places[index + 1]);
    c.stroke();
  }
}

/** Paint words upon the ground, upright where that has more room, or not at all where there is none. */
function paint(c, view, { lines, middle, drop = 0, ink, size, along }, ui) {
  const [across, down] = (view.turned ? [...along].reverse() : along).map((length) => length * view.scale), wanted = size * ui;
  const upright = Math.min(down, wanted) > Math.min(across, wanted), high = Math.round(Math.min(wanted, Math.max(across, down)));
  if (high < LEGIBLE) return null;
  const [x, up] = point(view, ...middle), y = up + drop * view.scale;
  c.save();
  c.translate(x, y);
  if (upright) c.rotate(-Math.PI / 2);
  setFont(c, high);
  c.globalAlpha = 0.75;
  c.fillStyle = css(ink);
  c.textAlign = "center";
  c.textBaseline = "middle";
  lines.forEach((line, index) => c.fillText(line, 0, (index - (lines.length - 1) / 2) * 1.25 * high));
  const sides = [Math.max(...lines.map((line) => c.measureText(line).width)), 1.25 * high * lines.length];
  c.restore();
  const [width, height] = upright ? sides.reverse() : sides;
  return { left: x - width / 2, top: y - height / 2, width, height };
}

/** Draw shapes of a square of side 1 about the origin, `side` pixels large. */
export function drawSign(c, sign, x, y, side, ui = 1) {
  const frame = frameOf({ x: 0, y: 0, left: x, top: y, scale: side, quarters: 0 }, {}, 1, { x: 0, y: 0, theta: 0 });
  for (const shape of sign) drawShape(c, frame, shape, ui);
}

/** A canvas with a sign. */
export function badge(sign, name = "badge") {
  const canvas = document.createElement("canvas");
  canvas.className = name;
  canvas.width = canvas.height = 36;
  drawSign(canvas.getContext("2d"), sign, 18, 18, 36);
  return canvas;
}
