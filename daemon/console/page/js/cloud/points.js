// The map as vertices: cells at their depth, the vehicle, its track, a grid.

import { shownAs } from "../book.js";
import { rgb } from "../palette.js";
import { nice } from "../format.js";
import { boundsOf } from "../levels.js";
import { EDGE } from "../tiles.js";

export const depthLayer = (map) => map.layers.find((l) => l.is_depth) ?? null;

/** Cells as points {places, tints}; z is minus the depth if the map has depths, else 0. `tone(label)` is the colour [r, g, b] of a
 * shown label; `known` keeps the points of tiles. */
export function cellPoints(map, tone, known) {
  const depth = depthLayer(map);
  const parts = [...map.tiles.values()].map((tile) => {
    const kept = known.get(tile);
    if (kept && kept.hasDepth === Boolean(depth)) return kept;
    const made = tilePoints(map, tile, depth, tone);
    known.set(tile, made);
    return made;
  });
  const count = parts.reduce((sum, p) => sum + p.places.length / 3, 0);
  const all = { places: new Float32Array(3 * count), tints: new Uint8Array(4 * count) };
  let at = 0;
  for (const { places, tints } of parts) {
    all.places.set(places, 3 * at);
    all.tints.set(tints, 4 * at);
    at += places.length / 3;
  }
  return all;
}

function tilePoints(map, tile, depth, tone) {
  const places = [];
  const tints = [];
  tile.eachCell((x, y, label) => {
    const level = depth ? tile.parts[depth.number]?.level(x, y) ?? 0 : 0;
    if (depth && level === 0) return;
    const [from, to] = depth ? boundsOf(depth, level) : [0, 0];
    places.push((tile.column * EDGE + x + 0.5) * map.cell_m, (tile.row * EDGE + y + 0.5) * map.cell_m, -(from + to) / 2);
    tints.push(...tone(shownAs(label)), 255);
  });
  return { places, tints, hasDepth: Boolean(depth) };
}

export function meanHeight(places) {
  let sum = 0;
  for (let i = 2; i < places.length; i += 3) sum += places[i];
  return places.length ? sum / (places.length / 3) : 0;
}

/** Line segments of a grid of round metres at height `z` around the map. */
export function gridLines([west, south, east, north], z, hex) {
  const step = nice(Math.max(east - west, north - south) / 4);
  const [w, s, e, n] = [west, south, east, north].map((v, i) => (i < 2 ? Math.floor : Math.ceil)(v / step) * step);
  const places = [];
  for (let x = w; x <= e + step / 2; x += step) places.push(x, s, z, x, n, z);
  for (let y = s; y <= n + step / 2; y += step) places.push(w, y, z, e, y, z);
  return { step, ...coloured(places, hex) };
}

/** The vehicle at its depth (or just over a flat map), a plumb line to the floor, its track, its bow. */
export function vehicleShape(vehicle, floor, flat, hex) {
  const places = [];
  const hull = [];
  const s = vehicle.status;
  const z = flat || !s ? floor + 1 : s.z_m;
  for (let i = 1; i < vehicle.track.length; i += 1) {
    const [[, ax, ay], [, bx, by]] = [vehicle.track[i - 1], vehicle.track[i]];
    places.push(ax, ay, z, bx, by, z);
  }
  if (s) {
    const a = (s.heading_deg * Math.PI) / 180;
    const at = (forward, right) => [
      s.x_m + forward * Math.sin(a) + right * Math.cos(a), s.y_m + forward * Math.cos(a) - right * Math.sin(a), z,
    ];
    const [bow, left, stern, right] = [at(1.3, 0), at(-0.9, -0.7), at(-0.4, 0), at(-0.9, 0.7)];
    hull.push(...bow, ...left, ...stern, ...bow, ...stern, ...right);
    places.push(s.x_m, s.y_m, z, s.x_m, s.y_m, floor);
  }
  return { lines: coloured(places, hex), hull: coloured(hull, hex) };
}

function coloured(places, hex) {
  const tints = new Uint8Array((places.length / 3) * 4);
  const tone = [...rgb(hex), 255];
  for (let i = 0; i < tints.length; i += 1) tints[i] = tone[i % 4];
  return { places: new Float32Array(places), tints };
}
