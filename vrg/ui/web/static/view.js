// Converts metres on the field to pixels. Pure functions of values; the same rules as in the window of the spectator.

/** How often a page is asked to turn the field by a quarter to the right, such as once by ?turn=90. */
export function asked(search) {
  const turn = Number(new URLSearchParams(search).get("turn"));
  return turn % 90 === 0 ? (((turn / 90) % 4) + 4) % 4 : 0;
}

/** Show a box [xMin, yMin, xMax, yMax], m, as large as an area {left, top, width, height}, pixels, allows.
 *  It is turned by a quarter where that shows it larger in `whole`, the area while nothing else takes room, and from there
 *  by so many quarters `more` as are asked for. */
export function fit(box, area, whole = area, more = 0) {
  const wide = Math.max(box[2] - box[0], 0.1), tall = Math.max(box[3] - box[1], 0.1);
  const scaleIn = (a, turned) => (turned ? Math.min(a.width / tall, a.height / wide) : Math.min(a.width / wide, a.height / tall));
  const quarters = (Number(scaleIn(whole, true) > scaleIn(whole, false) * 1.02) + more) % 4;
  const turned = quarters % 2 === 1;
  return {
    x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2,
    left: area.left + area.width / 2, top: area.top + area.height / 2,
    scale: Math.max(scaleIn(area, turned), 0.01), turned, quarters,
  };
}

/** Where a point of the field, m, is: [pixels from the left, pixels from the top]. */
export function point(view, x, y) {
  const dx = (x - view.x) * view.scale, dy = (y - view.y) * view.scale;
  const [right, down] = [[dx, -dy], [dy, dx], [-dx, dy], [-dy, -dx]][view.quarters];
  return [view.left + right, view.top + down];
}

/** A heading on the field as an angle on the screen, rad: 0 is right, pi/2 is up. */
export function angle(view, theta) {
  return theta - (view.quarters * Math.PI) / 2;
}

/** The point of the field, m, at pixels from the left and from the top: what `point` undoes. */
export function place(view, px, py) {
  const right = (px - view.left) / view.scale, down = (py - view.top) / view.scale;
  const [dx, dy] = [[right, -down], [down, right], [-right, down], [-down, -right]][view.quarters];
  return [view.x + dx, view.y + dy];
}
