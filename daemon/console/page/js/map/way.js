// Where a vehicle is going: to its waypoint, a cross, and what it plans from there. All of it is as old as its pose.

/** Places from the vehicle on: itself, its waypoint, its path. */
export const wayOf = (s) => (s.waypoint ? [[s.x_m, s.y_m], s.waypoint, ...(s.path ?? [])] : []);

/** Metres of a way. */
export const lengthOf = (way) => way.slice(1).reduce((sum, [x, y], i) => sum + Math.hypot(x - way[i][0], y - way[i][1]), 0);

export function drawWay(c, view, ink, s, stale) {
  const way = wayOf(s).map(([x, y]) => view.toScreen(x, y));
  if (way.length === 0) return;
  const [here, waypoint, ...path] = way;
  c.lineJoin = "round";
  // The ground is whole, so that dashes show on a track that went the same way.
  for (const [style, width, near, far] of [[ink.sea, 4, [], []], [stale ? ink.stale : ink.text, 1.75, [3, 4], [8, 5]]]) {
    c.strokeStyle = style;
    c.fillStyle = style;
    c.lineWidth = width;
    dashed(c, near, [here, waypoint]);
    dashed(c, far, [waypoint, ...path]);
    for (const [x, y] of path) dot(c, x, y, width + 1);
    if (s.path_goes_on && path.length > 0) arrowHead(c, way.at(-2), way.at(-1));
    cross(c, ...waypoint);
  }
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

/** The plan has more than is drawn. */
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
