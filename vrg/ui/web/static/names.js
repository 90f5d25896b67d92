// Chooses where the names of the robots stand, so that none covers another and each is seen to belong to its robot.
// Boxes are {left, top, width, height} in pixels; a robot is a circle {x, y, radius}. Pure, but that it remembers places.

const SIDES = [[0, 1], [0, -1], [1, 0], [-1, 0], [1, 1], [-1, 1], [1, -1], [-1, -1]];
const STEPS = [0, 1.2, 2.4, 3.6];
const COVERED = 600, DOUBTFUL = 400, LONG = 40, LOYAL = 35, PATIENT = 390, CLEARLY = 4;
const CROWD = 8;

export class Names {
  constructor() {
    this.last = new Map();
    this.crowded = false;
  }

  /** Place the names of robots [{name, circle, remark}] within an area. `measure` gives the width of a text.
   *  Returns [{index, text, box, line}]; `line` is where a line from the robot to a distant name ends, or null. */
  place(robots, area, measure, height) {
    const words = this.words(robots, measure).map((word, index) => [word, robots[index].remark].filter(Boolean).join(" "));
    const circles = robots.map((robot) => robot.circle);
    const taken = circles.map(({ x, y, radius }) => ({ left: x - radius - 2, top: y - radius - 2, width: 2 * radius + 4, height: 2 * radius + 4 }));
    return robots.map((robot, index) => {
      const size = { width: measure(words[index]) + 10, height };
      const box = this.best(robot.name, size, index, circles, taken, area);
      taken.push(box);
      const centre = [robot.circle.x, robot.circle.y];
      const end = nearest(box, centre);
      const far = Math.hypot(end[0] - centre[0], end[1] - centre[1]) > robot.circle.radius + height;
      return { index, text: words[index], box, line: far ? end : null };
    });
  }

  /** The names, or in a crowd what tells them apart: 7 and 12 for player7 and player12. */
  words(robots, measure) {
    const names = robots.map((robot) => robot.name);
    const short = numbers(names);
    if (!short || names.length < CROWD) return names;
    const gaps = robots.map(({ circle: a }) => Math.min(...robots.filter(({ circle: b }) => b !== a).map(({ circle: b }) => Math.hypot(a.x - b.x, a.y - b.y)))).sort((a, b) => a - b);
    const widest = Math.max(...names.map(measure));
    this.crowded = gaps[gaps.length >> 1] < widest * (this.crowded ? 1.5 : 1);
    return this.crowded ? short : names;
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

/** The numbers at the ends of names that are otherwise the same, or null where they are not. */
export function numbers(names) {
  const stems = new Set(names.map((name) => name.replace(/\d+$/, "")));
  const [stem] = stems;
  const found = names.map((name) => name.slice(stem?.length));
  return stems.size === 1 && stem && found.every(Boolean) ? found : null;
}

export function overlap(a, b) {
  const width = Math.min(a.left + a.width, b.left + b.width) - Math.max(a.left, b.left);
  const height = Math.min(a.top + a.height, b.top + b.height) - Math.max(a.top, b.top);
  return width > 0 && height > 0 ? width * height : 0;
}

function beside(size, { x, y, radius }, side, away) {
  const cx = x + side[0] * (radius + 4 + size.width / 2 + away), cy = y + side[1] * (radius + 4 + size.height / 2 + away);
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
  const others = circles.filter((_, index) => index !== own);
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
