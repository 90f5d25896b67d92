// Places words beside figures, so that none covers another and each is seen to belong to its own: as vrg/ui/labels.py does.
// Boxes are {left, top, width, height} in pixels; a circle is {x, y, radius}. Pure, but that it remembers places.

const SIDES = [[0, 1], [0, -1], [1, 0], [-1, 0], [1, 1], [-1, 1], [1, -1], [-1, -1]];
const STEPS = [0, 1.2, 2.4, 3.6];
const COVERED = 600, DOUBTFUL = 400, LONG = 40, LOYAL = 35, PATIENT = 390, CLEARLY = 4, GAP = 4;
/** From how many robots on their names may be shortened. */
const CROWD = 8;

export class Placer {
  constructor() {
    this.last = new Map();
    this.crowded = false;
  }

  /** Place labels [{name, label, circle}] within an area. `measure` gives the width and the height of a label's text.
   *  No box lies upon what is `painted`. Returns [{name, label, text, box, line}]; `line` leads from the circle to words far from it, or is null. */
  place(labels, area, measure, painted = []) {
    this.look(labels, measure);
    const circles = labels.map(({ circle }) => circle);
    const taken = circles.filter(({ radius }) => radius).map(({ x, y, radius }) => ({ left: x - radius - 2, top: y - radius - 2, width: 2 * radius + 4, height: 2 * radius + 4 }));
    taken.push(...painted);
    return labels.map(({ name, label, circle }, index) => {
      const text = [this.crowded && label.short ? label.short : label.words, label.remark].filter(Boolean).join(" ");
      const [width, height] = measure(text, label);
      const box = this.best(name, { width: width + 10, height }, index, circles, taken, area);
      taken.push(box);
      const end = nearest(box, [circle.x, circle.y]), far = Math.hypot(end[0] - circle.x, end[1] - circle.y), share = circle.radius / far;
      const line = far > circle.radius + height ? [[circle.x + (end[0] - circle.x) * share, circle.y + (end[1] - circle.y) * share], end] : null;
      return { name, label, text, box, line };
    });
  }

  /** See whether robots lie so close that what is short stands for their names. */
  look(labels, measure) {
    const named = labels.filter(({ label }) => label.short);
    if (named.length < CROWD) return void (this.crowded = false);
    const apart = ({ circle: a }, { circle: b }) => Math.hypot(a.x - b.x, a.y - b.y);
    const gaps = named.map((one) => Math.min(...named.filter((other) => other !== one).map((other) => apart(one, other)))).sort((a, b) => a - b);
    const widest = Math.max(...named.map(({ label }) => measure(label.words, label)[0]));
    this.crowded = gaps[gaps.length >> 1] < widest * (this.crowded ? 1.5 : 1);
  }

  best(name, size, own, circles, taken, area) {
    const last = this.last.get(name);
    let best = null, bestPlace = 0, bestCost = Infinity;
    const places = [...Array(STEPS.length * SIDES.length).keys()];
    if (last !== undefined) places.unshift(...places.splice(last, 1));
    for (const place of places) {
      const step = Math.floor(place / SIDES.length), side = SIDES[place % SIDES.length], stays = place === last;
      let cost = LONG * step - (stays ? LOYAL : 0);
      if (cost >= bestCost) continue;
      const tried = clamp(beside(size, circles[own], side, STEPS[step] * size.height), area);
      let harm = 0;
      for (const other of taken) {
        const covered = overlap(tried, other);
        if (covered > 0) harm += COVERED + covered;
      }
      if (cost + harm - (stays ? PATIENT : 0) < bestCost) harm += DOUBTFUL * doubts(tried, own, circles, step > 0);
      cost += Math.max(0, harm - (stays ? PATIENT : 0));
      if (cost < bestCost) [best, bestPlace, bestCost] = [tried, place, cost];
    }
    this.last.set(name, bestPlace);
    return best;
  }
}

function overlap(a, b) {
  const width = Math.min(a.left + a.width, b.left + b.width) - Math.max(a.left, b.left);
  const height = Math.min(a.top + a.height, b.top + b.height) - Math.max(a.top, b.top);
  return width > 0 && height > 0 ? width * height : 0;
}

function beside(size, { x, y, radius }, side, away) {
  const cx = x + side[0] * (radius + GAP + size.width / 2 + away), cy = y + side[1] * (radius + GAP + size.height / 2 + away);
  return { left: cx - size.width / 2, top: cy - size.height / 2, ...size };
}

function clamp(box, area) {
  const left = Math.max(area.left, Math.min(box.left, area.left + area.width - box.width));
  const top = Math.max(area.top, Math.min(box.top, area.top + area.height - box.height));
  return { ...box, left, top };
}

function nearest(box, [x, y]) {
  return [Math.min(Math.max(x, box.left), box.left + box.width), Math.min(Math.max(y, box.top), box.top + box.height)];
}

function edge(box, { x, y, radius }) {
  const [px, py] = nearest(box, [x, y]);
  return Math.hypot(px - x, py - y) - radius;
}

/** How many other robots the box may be taken for, or its line crosses. */
function doubts(box, own, circles, led) {
  const others = circles.filter(({ radius }, index) => index !== own && radius);
  if (!led) {
    const clear = edge(box, circles[own]) + CLEARLY;
    return others.filter((other) => edge(box, other) < clear).length;
  }
  const { x, y } = circles[own], [ex, ey] = nearest(box, [x, y]);
  const length = (ex - x) ** 2 + (ey - y) ** 2 || 1;
  return others.filter((other) => {
    const share = Math.max(0, Math.min(1, ((other.x - x) * (ex - x) + (other.y - y) * (ey - y)) / length));
    return Math.hypot(other.x - x - share * (ex - x), other.y - y - share * (ey - y)) < other.radius;
  }).length;
}
