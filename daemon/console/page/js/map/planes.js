// How a layer is painted: its colour scale and the values at the ends of the scale.

import { CIVIDIS, INFERNO, ramp } from "../palette.js";
import { planeText } from "./readout.js";

/** The share of the cells that may lie beyond each end of a scale, since a few cells are far more surprising than all others. */
const BEYOND = { curiosity: 0.02 };
const looks = new WeakMap();

/** The lowest and the highest byte on the scale of the layer, and whether cells lie below or above. */
function ends(plane) {
  const cells = new Uint32Array(256);
  for (const v of plane.data) cells[v] += 1;
  const all = plane.data.length - cells[255];
  const most = (BEYOND[plane.name] ?? 0) * all;
  const end = (from, step) => {
    let [v, seen] = [from, cells[from]];
    while (all > 0 && seen <= most) seen += cells[(v += step)];
    return v;
  };
  if (!(plane.name in BEYOND) || all === 0) return { low: 0, high: 254, below: false, above: false };
  const [low, high] = [end(0, 1), end(254, -1)];
  const any = (from, to) => cells.subarray(from, to).some((n) => n > 0);
  return { low, high, below: any(0, low), above: any(high + 1, 255) };
}

/** Of a layer: `tone(byte, red)` is the colour of a cell, `at(t, red)` that of a place on the scale; `low` and `high` are the texts at its ends. */
export function lookOf(plane) {
  if (looks.has(plane)) return looks.get(plane);
  const { low, high, below, above } = ends(plane);
  const half = (plane.step ?? 0) / 2;
  const value = (v) => plane.min + ((plane.max - plane.min) * v) / 254;
  const knots = plane.name === "curiosity" ? INFERNO : CIVIDIS;
  const at = (t, red) => ramp(t, red, knots);
  const look = {
    at,
    tone: (v, red) => at(high > low ? (v - low) / (high - low) : 0.5 + Math.sign(v - low) / 2, red),
    low: below ? `up to ${planeText(plane, value(low) + half)}` : planeText(plane, value(low) - half),
    high: above ? `${planeText(plane, value(high) - half)} and more` : planeText(plane, value(high) + half),
  };
  looks.set(plane, look);
  return look;
}
