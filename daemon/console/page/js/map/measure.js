// The measure tool: two or more points, the length of each leg and the sum.

import { FONT, haloText } from "../canvas.js";
import { degrees, metres } from "../format.js";

export const measure = { on: false, points: [], pointer: null };

export function toggleMeasure() {
  measure.on = !measure.on;
  measure.points = [];
  measure.pointer = null;
}

export function addPoint(x, y) {
  measure.points.push([x, y]);
}

/** Compass bearing from a to b in degrees. */
export const bearing = (a, b) => (Math.atan2(b[0] - a[0], b[1] - a[1]) * 180) / Math.PI;

export function drawMeasure(c, view, ink) {
  if (!measure.on || measure.points.length === 0) return;
  const points = measure.pointer ? [...measure.points, measure.pointer] : measure.points;
  for (const [style, width] of [[ink.sea, 4], [ink.accent, 2]]) {
    c.strokeStyle = style;
    c.lineWidth = width;
    c.beginPath();
    for (const p of points) c.lineTo(...view.toScreen(...p));
    c.stroke();
  }
  c.font = FONT;
  c.textAlign = "left";
  let sum = 0;
  points.forEach((p, i) => {
    const [px, py] = view.toScreen(...p);
    c.fillStyle = ink.accent;
    c.fillRect(px - 3, py - 3, 6, 6);
    if (i === 0) return;
    const before = points[i - 1];
    const leg = Math.hypot(p[0] - before[0], p[1] - before[1]);
    sum += leg;
    const total = i > 1 ? `, sum ${metres(sum, 2)}` : "";
    haloText(c, `${metres(leg, 2)} at ${degrees(bearing(before, p))}${total}`, px + 9, py + 4, ink);
  });
}
