// One fixed colour per label id, 1..254, told apart under the common kinds of colour blindness.

import { TABLE } from "./palette-table.js";

/** "#rrggbb" of a label id. */
export function tableColour(id) {
  const at = ((id - 1) % 254) * 6;
  return `#${TABLE.slice(at, at + 6)}`;
}

/** [r, g, b], 0..255. */
export function rgb(hex) {
  const n = parseInt(hex.slice(1), 16);
  return [n >> 16, (n >> 8) & 255, n & 255];
}

// Cividis (Nuñez, Anderton and Renslow 2018), nine knots: its order can be read with every kind of colour vision.
export const CIVIDIS = [
  [0, 34, 78], [33, 58, 112], [76, 83, 109], [108, 110, 114], [125, 124, 120],
  [150, 144, 118], [181, 170, 104], [217, 199, 77], [254, 232, 56],
];

// Inferno (van der Walt and Smith 2015) without its ends, which are as dark and as bright as the sea: a second scale of this kind.
export const INFERNO = [
  [33, 12, 74], [86, 16, 110], [137, 34, 106], [187, 55, 84], [227, 89, 50], [249, 140, 10], [249, 201, 50],
];

/** The sequential scales, by the names that layers give them. */
export const PALETTES = { cividis: CIVIDIS, inferno: INFERNO };

/** Shades of red for the red theme: neighbouring ids get shades far apart (van der Corput). */
export function redShade(id) {
  let [level, part] = [0, 0.5];
  for (let n = id; n > 0; n >>= 1, part /= 2) level += (n & 1) * part;
  return redLevel(0.24 + 0.76 * level);
}

const redLevel = (t) => [Math.round(255 * t), Math.round(50 * t * t), Math.round(36 * t * t)];

/** A shade of red as bright as [r, g, b]. */
export const redTone = ([r, g, b]) => redLevel((0.3 * r + 0.59 * g + 0.11 * b) / 255);

/** Colour of t in 0..1 on a sequential scale, in shades of red if `red`. */
export function ramp(t, red = false, knots = CIVIDIS) {
  if (red) return redLevel(0.14 + 0.86 * Math.min(1, Math.max(0, t)));
  const at = Math.min(1, Math.max(0, t)) * (knots.length - 1);
  const i = Math.min(knots.length - 2, Math.floor(at));
  return knots[i].map((v, c) => Math.round(v + (knots[i + 1][c] - v) * (at - i)));
}
