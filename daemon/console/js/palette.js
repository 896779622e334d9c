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

// Cividis (Nuñez, Anderton and Renslow 2018), nine knots: one reading order for every kind of sight.
const CIVIDIS = [
  [0, 34, 78], [33, 58, 112], [76, 83, 109], [108, 110, 114], [125, 124, 120],
  [150, 144, 118], [181, 170, 104], [217, 199, 77], [254, 232, 56],
];

/** Colour of t in 0..1 on the sequential scale. */
export function ramp(t) {
  const at = Math.min(1, Math.max(0, t)) * (CIVIDIS.length - 1);
  const i = Math.min(CIVIDIS.length - 2, Math.floor(at));
  return CIVIDIS[i].map((v, c) => Math.round(v + (CIVIDIS[i + 1][c] - v) * (at - i)));
}
