// Which outlines a vehicle can obey: the rules of protocol/src/directive/{polygon,fence}.rs in whole decimetres, as on the
// wire, so that the page refuses the same outlines as the daemon.

export const MAX_CORNERS = 34;
export const MAX_KEEP_OUTS = 15;
/** The distance from the origin beyond which the daemon takes a place for a typing error. */
export const MAX_DISTANCE_M = 100000;

const dm = ([x, y]) => [Math.round(x * 10), Math.round(y * 10)];

/** Metres as the wire can represent them. */
export const snap = ([x, y]) => dm([x, y]).map((d) => (d === 0 ? 0 : d / 10));

const cross = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
const same = (a, b) => a[0] === b[0] && a[1] === b[1];
const edges = (points) => points.map((p, i) => [p, points[(i + 1) % points.length]]);

function between(a, b, p) {
  return Math.min(a[0], b[0]) <= p[0] && p[0] <= Math.max(a[0], b[0])
    && Math.min(a[1], b[1]) <= p[1] && p[1] <= Math.max(a[1], b[1]);
}

const foldsBack = (a, b, c) => cross(a, b, c) === 0 && (between(a, b, c) || between(b, c, a));

function meet([a, b], [c, d]) {
  const apart = (p, q, r, s) => Math.sign(cross(p, q, r)) * Math.sign(cross(p, q, s));
  const touches = (p, q, r) => cross(p, q, r) === 0 && between(p, q, r);
  return (apart(a, b, c, d) < 0 && apart(c, d, a, b) < 0)
    || touches(a, b, c) || touches(a, b, d) || touches(c, d, a) || touches(c, d, b);
}

/** Whether (x, y) lies inside or on the edge of the outline, all in decimetres. */
function contains(points, p) {
  let inside = false;
  for (const [a, b] of edges(points)) {
    if (cross(a, b, p) === 0 && between(a, b, p)) return true;
    if (a[1] > p[1] !== b[1] > p[1]) inside = inside !== (cross(a, b, p) > 0 === b[1] > a[1]);
  }
  return inside;
}

/** The fault of an outline in metres, or null. */
export function outlineFault(metres) {
  const points = metres.map(dm);
  const n = points.length;
  if (n < 3 || n > MAX_CORNERS) return `${n} ${n === 1 ? "corner" : "corners"}: an outline has 3 to ${MAX_CORNERS}`;
  const far = metres.findIndex((p) => !p.every((m) => Math.abs(m) <= MAX_DISTANCE_M));
  if (far >= 0) return `Corner ${far + 1} is farther than ${MAX_DISTANCE_M / 1000} km from the origin`;
  const sides = edges(points);
  const twice = sides.findIndex(([a, b]) => same(a, b));
  if (twice >= 0) return `Corners ${twice + 1} and ${((twice + 1) % n) + 1} are at the same place`;
  if (sides.every(([a, b]) => cross(points[0], a, b) === 0)) return "It has no area";
  for (let i = 0; i < n; i += 1)
    for (let j = i + 1; j < n; j += 1) {
      const meets = j === i + 1
        ? foldsBack(points[i], points[j], points[(j + 1) % n])
        : i === 0 && j === n - 1
          ? foldsBack(points[j], points[0], points[1])
          : meet(sides[i], sides[j]);
      if (meets) return `The side after corner ${i + 1} crosses or touches the one after corner ${j + 1}`;
    }
  return null;
}

/** Whether keep-out `points` covers all of `fence`, both in metres. */
export function covers(points, fence) {
  const [keepOut, field] = [points.map(dm), fence.map(dm)];
  const apart = !edges(field).some((e) => edges(keepOut).some((f) => meet(e, f)));
  return apart && field.every((p) => contains(keepOut, p));
}

/** The area of an outline in metres, square metres. */
export const areaOf = (points) => Math.abs(edges(points).reduce((sum, [a, b]) => sum + a[0] * b[1] - b[0] * a[1], 0)) / 2;

/** The distance of a place from the nearest edge of an outline, metres. */
export const distanceTo = (points, [x, y]) => Math.min(...edges(points).map(([[ax, ay], [bx, by]]) => {
  const [dx, dy] = [bx - ax, by - ay];
  const along = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(ax + along * dx - x, ay + along * dy - y);
}));

/** Whether (x, y) metres lies inside or on the edge of an outline in metres. */
export const holds = (points, place) => contains(points.map(dm), dm(place));
