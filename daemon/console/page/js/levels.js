// The levels of a layer: their bounds, and values as text.

import { minus, percent } from "./format.js";

/** The bounds of a level in the layer's unit. */
export const boundsOf = (layer, level) => layer.edges.slice(level - layer.lowest, level - layer.lowest + 2);

/** A value with its unit; a value without a unit is a share. */
export const valueText = (layer, value) => (layer.unit === "" ? percent(value) : `${minus(String(Number(value.toFixed(1))))} ${layer.unit}`);
