// The planned path of a vehicle: to its waypoint, a cross, and on from there. It is as old as the status.

/** The places of the path: the vehicle, its waypoint, the further waypoints. */
export const pathOf = (s) => (s.waypoint ? [[s.x_m, s.y_m], s.waypoint, ...(s.path ?? [])] : []);

/** Length in metres. */
export const lengthOf = (places) => places.slice(1).reduce((sum, [x, y], i) => sum + Math.hypot(x - places[i][0], y - places[i][1]), 0);

/** The colour of a reason; what has none of its own is drawn as other. */
const toneOf = (ink, reason) => ink[`reason-${reason}`] || ink["reason-other"];

/** Dashed legs in the colours of their reasons: {to: [x, y], reason}. */
export function drawLegs(c, view, ink, from, legs, dash, width) {
  c.lineJoin = "round";
  for (const isCasing of [true, false]) {
    let before = from;
    for (const { to, reason } of legs) {
      c.strokeStyle = isCasing ? ink.sea : toneOf(ink, reason);
      c.lineWidth = isCasing ? width + 2.5 : width;
      dashed(c, isCasing ? [] : dash, [before, to].map(([x, y]) => view.toScreen(x, y)));
      before = to;
    }
  }
}

/** Lights the cells that a plan leads to: rows of [row, first column, last column]. */
export function drawTargets(c, view, ink, rows, cell_m) {
  const before = c.globalAlpha;
  c.globalAlpha = 0.4 * before;
  c.fillStyle = ink["reason-label"];
  for (const [row, first, last] of rows) {
    const [left, top] = view.toScreen(first * cell_m, (row + 1) * cell_m);
    const [right, bottom] = view.toScreen((last + 1) * cell_m, row * cell_m);
    c.fillRect(left, top, right - left, bottom - top);
  }
  c.globalAlpha = before;
}

/** The plan as reported, in the colours of its reasons while it is not stale. */
export function drawPath(c, view, ink, s, stale, aims = null, cell_m = 0) {
  if (aims && !stale && s.waypoint) drawTargets(c, view, ink, aims.targets, cell_m);
  const places = pathOf(s).map(([x, y]) => view.toScreen(x, y));
  if (places.length === 0) return;
  const [here, waypoint, ...path] = places;
  c.lineJoin = "round";
  // The background is solid, so that dashes show on a track along the same line.
  for (const [style, width, near, far] of [[ink.sea, 4, [], []], [stale ? ink.stale : ink.text, 1.75, [3, 4], [8, 5]]]) {
    c.strokeStyle = style;
    c.fillStyle = style;
    c.lineWidth = width;
    dashed(c, near, [here, waypoint]);
    dashed(c, far, [waypoint, ...path]);
    for (const [x, y] of path) dot(c, x, y, width + 1);
    if (s.path_continues && path.length > 0) arrowHead(c, places.at(-2), places.at(-1));
    cross(c, ...waypoint);
  }
  if (aims && !stale) drawLegs(c, view, ink, [s.x_m, s.y_m], aims.legs, [8, 5], 2.5);
}

function dashed(c, dashes, places) {
  c.beginPath();
  c.setLineDash(dashes);
  for (const [x, y] of places) c.lineTo(x, y);
  c.stroke();
  c.setLineDash([]);
}

function dot(c, x, y, radius) {
  c.beginPath();
  c.arc(x, y, radius, 0, 2 * Math.PI);
  c.fill();
}

/** Marks a plan that continues beyond the last place. */
function arrowHead(c, [fromX, fromY], [x, y]) {
  const course = Math.atan2(y - fromY, x - fromX);
  const tip = [x + 12 * Math.cos(course), y + 12 * Math.sin(course)];
  c.beginPath();
  c.moveTo(tip[0] + 9 * Math.cos(course + 2.6), tip[1] + 9 * Math.sin(course + 2.6));
  c.lineTo(...tip);
  c.lineTo(tip[0] + 9 * Math.cos(course - 2.6), tip[1] + 9 * Math.sin(course - 2.6));
  c.stroke();
}

function cross(c, x, y) {
  c.beginPath();
  c.moveTo(x - 6, y - 6);
  c.lineTo(x + 6, y + 6);
  c.moveTo(x + 6, y - 6);
  c.lineTo(x - 6, y + 6);
  c.stroke();
}
