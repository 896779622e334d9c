// Paints tiles of a map into offscreen canvases, one pixel a cell, north up.

import { ramp } from "../palette.js";
import { current as theme } from "../theme.js";
import { EDGE } from "../tiles.js";
import { paintBlocks } from "./coarse.js";
import { lookOf } from "./layer-look.js";

const shade = (t) => ramp(t, theme() === "red");
const UNKNOWN = [128, 128, 128, 90];

/** The canvas of a tile; `toneOf(tile, x, y, label)` gives [r, g, b, a] for a cell, `paleOf(label)` for coarse `blocks`. */
export function paintTile(tile, toneOf, blocks, paleOf) {
  const canvas = document.createElement("canvas");
  canvas.width = EDGE;
  canvas.height = EDGE;
  const context = canvas.getContext("2d");
  const image = context.createImageData(EDGE, EDGE);
  paintBlocks(image.data, blocks, tile, paleOf);
  tile.eachCell((x, y, label) => {
    const c = toneOf(tile, x, y, label);
    const to = 4 * ((EDGE - 1 - y) * EDGE + x);
    image.data[to] = c[0];
    image.data[to + 1] = c[1];
    image.data[to + 2] = c[2];
    image.data[to + 3] = c[3];
  });
  context.putImageData(image, 0, 0);
  return canvas;
}

const samples = new WeakMap();

/** The colour of a tile that is too small to be drawn: that of a cell with its most frequent label. */
export function sampleTone(tile, toneOf) {
  if (!samples.has(tile)) {
    const cells = new Map();
    let most = null;
    tile.eachCell((x, y, label) => {
      const found = cells.get(label) ?? { x, y, label, count: 0 };
      found.count += 1;
      cells.set(label, found);
      if (!most || found.count > most.count) most = found;
    });
    samples.set(tile, most);
  }
  const cell = samples.get(tile);
  return cell && toneOf(tile, cell.x, cell.y, cell.label);
}

const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);

/** The colour of each label, label -> [r, g, b, a], from `toneOf(label)`: grey when stale, faint when another label is highlighted. */
export function labelTones({ toneOf, shownAs, stale, highlight }) {
  const table = new Array(256);
  const lookup = (label) => {
    const shown = shownAs(label);
    const [...full] = toneOf(shown);
    const alpha = full.pop();
    const grey = 0.3 * full[0] + 0.59 * full[1] + 0.11 * full[2];
    const pale = theme() === "red" ? [grey, 0, 0] : [grey, grey, grey];
    const tone = stale ? mix(full, pale, 0.7) : full;
    return [...tone, highlight === null || highlight === shown ? alpha : 36];
  };
  return (label) => (table[label] ??= lookup(label));
}

/** The age of each cell, on the sequential scale from 0 to `top` seconds. */
export const ageTones = (nowS, top) => (tile, x, y) => {
  const timeS = tile.labels.time(x, y);
  return timeS === null ? UNKNOWN : [...shade(1 - Math.max(0, nowS - timeS) / top), 255];
};

/** A layer of the server: one level a cell, 0 unknown; faint when stale. */
export function layerTones(layer, stale) {
  const look = lookOf(layer);
  const table = new Array(256);
  const lookup = (level) => {
    const full = look.tone(level, theme() === "red");
    return [...(stale ? mix(full, [128, 128, 128], 0.7) : full), 255];
  };
  return (tile, x, y) => {
    const level = tile.parts[layer.number]?.level(x, y) ?? 0;
    return level === 0 ? UNKNOWN : (table[level] ??= lookup(level));
  };
}

/** Another vehicle's map: only its explored cells, since its label numbers have another meaning. */
export const footprintTones = () => () => [128, 128, 128, 80];
