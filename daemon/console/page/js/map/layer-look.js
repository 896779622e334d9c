// How a layer is painted: its colour scale and the values at the ends of the scale.

import { boundsOf, valueText } from "../levels.js";
import { PALETTES, ramp } from "../palette.js";

/** The share of the cells that may lie beyond each end of a scale, by the layer's spread: a few odd cells do not dim the others. */
const BEYOND = { common: 0.02 };
const looks = new WeakMap();

/** The lowest and the highest level on the scale of the layer, and whether cells lie below or above. */
function ends(layer) {
  const top = layer.lowest + layer.edges.length - 2;
  const cells = layer.counts;
  const all = cells.subarray(1).reduce((sum, n) => sum + n, 0);
  const share = BEYOND[layer.spread];
  if (share === undefined || all === 0) return { low: layer.lowest, high: top, below: false, above: false };
  const end = (from, step) => {
    let [level, seen] = [from, cells[from]];
    while (seen <= share * all) seen += cells[(level += step)];
    return level;
  };
  const [low, high] = [end(layer.lowest, 1), end(top, -1)];
  const any = (from, to) => cells.subarray(from, to).some((n) => n > 0);
  return { low, high, below: any(1, low), above: any(high + 1, 256) };
}

/** Of a layer: `tone(level, red)` is the colour of a cell, `at(t, red)` that of a place on the scale; `low` and `high` are the texts at its ends. */
export function lookOf(layer) {
  if (looks.has(layer)) return looks.get(layer);
  const { low, high, below, above } = ends(layer);
  const [lowFrom, lowTo] = boundsOf(layer, low);
  const [highFrom, highTo] = boundsOf(layer, high);
  const at = (t, red) => ramp(t, red, PALETTES[layer.palette]);
  const look = {
    at,
    tone: (level, red) => at(high > low ? (level - low) / (high - low) : 0.5 + Math.sign(level - low) / 2, red),
    low: below ? `up to ${valueText(layer, lowTo)}` : valueText(layer, lowFrom),
    high: above ? `${valueText(layer, highFrom)} and more` : valueText(layer, highTo),
  };
  looks.set(layer, look);
  return look;
}
