// Converts metres on the field to pixels. Pure functions of values; the same rules as in the window of the spectator.

/** Show a box [xMin, yMin, xMax, yMax], m, as large as an area {left, top, width, height}, pixels, allows.
 *  It is turned by a quarter where that shows it larger in `whole`, the area while nothing else takes room. */
export function fit(box, area, whole = area) {
  const wide = Math.max(box[2] - box[0], 0.1), tall = Math.max(box[3] - box[1], 0.1);
  const scaleIn = (a, turned) => (turned ? Math.min(a.width / tall, a.height / wide) : Math.min(a.width / wide, a.height / tall));
  const turned = scaleIn(whole, true) > scaleIn(whole, false) * 1.02;
  return {
    x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2,
    left: area.left + area.width / 2, top: area.top + area.height / 2,
    scale: Math.max(scaleIn(area, turned), 0.01), turned,
  };
}

/** Where a point of the field, m, is: [pixels from the left, pixels from the top]. */
export function point(view, x, y) {
  const dx = (x - view.x) * view.scale, dy = (y - view.y) * view.scale;
  return view.turned ? [view.left + dy, view.top + dx] : [view.left + dx, view.top - dy];
}

/** A heading on the field as an angle on the screen, rad: 0 is right, pi/2 is up. */
export function angle(view, theta) {
  return view.turned ? theta - Math.PI / 2 : theta;
}

/** The point of the field, m, at pixels from the left and from the top: what `point` undoes. */
export function place(view, px, py) {
  const dx = (px - view.left) / view.scale, dy = (py - view.top) / view.scale;
  return view.turned ? [view.x + dy, view.y + dx] : [view.x + dx, view.y - dy];
}
