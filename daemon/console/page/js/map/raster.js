// Paints a version of a map into an offscreen canvas, one pixel a cell, north up.

import { ramp } from "../palette.js";
import { current as theme } from "../theme.js";
import { lookOf } from "./layer-look.js";

const shade = (t) => ramp(t, theme() === "red");

/** The extent of explored cells in metres [west, south, east, north], or null. */
export function extent(map) {
  let [x0, y0, x1, y1] = [Infinity, Infinity, -1, -1];
  for (let y = 0; y < map.height; y += 1)
    for (let x = 0; x < map.width; x += 1) {
      if (map.labels[y * map.width + x] === 0) continue;
      x0 = Math.min(x0, x);
      x1 = Math.max(x1, x);
      y0 = Math.min(y0, y);
      y1 = Math.max(y1, y);
    }
  if (x1 < 0) return null;
  const m = map.cell_m;
  return [(map.x0 + x0) * m, (map.y0 + y0) * m, (map.x0 + x1 + 1) * m, (map.y0 + y1 + 1) * m];
}

/** The map's rectangle in metres [west, south, east, north]. */
export function rectangle(map) {
  const m = map.cell_m;
  return [map.x0 * m, map.y0 * m, (map.x0 + map.width) * m, (map.y0 + map.height) * m];
}

/** Paints `map`; `rgbaOf(at, label)` gives [r, g, b, a] for the cell at index `at`. */
function paint(map, rgbaOf) {
  const canvas = document.createElement("canvas");
  canvas.width = Math.max(1, map.width);
  canvas.height = Math.max(1, map.height);
  const context = canvas.getContext("2d");
  const image = context.createImageData(canvas.width, canvas.height);
  for (let y = 0; y < map.height; y += 1) {
    let to = (map.height - 1 - y) * map.width * 4;
    for (let x = 0; x < map.width; x += 1, to += 4) {
      const at = y * map.width + x;
      if (map.labels[at] === 0) continue;
      const c = rgbaOf(at, map.labels[at]);
      image.data[to] = c[0];
      image.data[to + 1] = c[1];
      image.data[to + 2] = c[2];
      image.data[to + 3] = c[3];
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);

/** The colour of each label, label -> [r, g, b, a]: grey when stale, faint when another label is highlighted. */
export function labelTones({ tintOf, shownAs, stale, highlight }) {
  const table = new Array(256);
  const lookup = (label) => {
    const shown = shownAs(label);
    const full = tintOf(shown);
    const grey = 0.3 * full[0] + 0.59 * full[1] + 0.11 * full[2];
    const pale = theme() === "red" ? [grey, 0, 0] : [grey, grey, grey];
    const tone = stale ? mix(full, pale, 0.7) : full;
    return [...tone, highlight === null || highlight === shown ? 255 : 36];
  };
  return (label) => (table[label] ??= lookup(label));
}

export function paintLabels(map, look) {
  const tones = labelTones(look);
  return paint(map, (_, label) => tones(label));
}

/** The age of each cell, on the sequential scale from 0 to `top` seconds. */
export function paintAge(map, sinceFetchS, top) {
  return paint(map, (at) => {
    const age = map.age[at];
    return age === 65535 ? [128, 128, 128, 90] : [...shade(1 - (age + sinceFetchS) / top), 255];
  });
}

/** A layer of the server: one level a cell, 0 unknown; faint when stale. */
export function paintLayer(map, layer, stale) {
  const look = lookOf(layer);
  return paint(map, (at) => {
    const level = layer.data[at];
    if (level === 0) return [128, 128, 128, 90];
    const full = look.tone(level, theme() === "red");
    return [...(stale ? mix(full, [128, 128, 128], 0.7) : full), 255];
  });
}

/** Another vehicle's map: only its explored cells, since its label numbers have another meaning. */
export function paintFootprint(map) {
  return paint(map, () => [128, 128, 128, 80]);
}
