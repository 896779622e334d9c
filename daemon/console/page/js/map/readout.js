// The readout of the cell under the pointer, or under the cross at the centre when the map is used by keys.

import { $, show, text } from "../dom.js";
import { metres, none, span } from "../format.js";
import { nameOf, shownAs } from "../book.js";
import { boundsOf, valueText } from "../levels.js";
import { ageOf, store } from "../store.js";
import { blockAt } from "./coarse.js";
import { onMap } from "./frames.js";

/** The cell at (x, y) metres in the map's frame: {at, label, ageS, layers}, `at` being its column and row, each layer with its own age; null if it is unexplored. */
export function cellAt(map, x, y) {
  const [cx, cy] = [x, y].map((v) => Math.floor(v / map.cell_m));
  const { level: label, timeS } = map.value(0, cx, cy);
  if (label === 0) return null;
  const layers = map.layers
    .map((l) => ({ ...l, ...map.value(l.number, cx, cy) }))
    .filter((l) => l.level !== 0)
    .map((l) => ({ ...l, ageS: ageOf(l.timeS) }));
  return { at: [cx, cy], label, ageS: ageOf(timeS), layers };
}

/** The label of the coarse block around the unexplored cell at (x, y) metres, or null. */
function coarseAt(map, x, y) {
  return blockAt(map, Math.floor(x / map.cell_m), Math.floor(y / map.cell_m))?.label ?? null;
}

export function showReadout(world) {
  const plate = $("readout");
  show(plate, world !== null);
  if (world === null) return null;
  const own = onMap(store.vehicle, ...world);
  const cell = store.map ? cellAt(store.map, ...own) : null;
  const parts = [`E ${metres(world[0])}  N ${metres(world[1])}`];
  const origin = store.snapshot?.mission.origin;
  if (origin) parts.push(latLon(origin, ...world));
  if (cell) {
    parts.push(nameOf(shownAs(cell.label)));
    parts.push(cell.ageS === null ? `age ${none}` : `received ${span(cell.ageS)} ago`);
    for (const p of cell.layers) parts.push(`${p.name} ${layerText(p)}${p.ageS === null ? "" : `, received ${span(p.ageS)} ago`}`);
  } else {
    const block = store.map ? coarseAt(store.map, ...own) : null;
    parts.push(block === null ? "unexplored" : `not sent; ${nameOf(shownAs(block))} at the one cell of 16 that was sent`);
  }
  text(plate, parts.join("  ·  "));
  return cell;
}

/** The bounds of the level of a cell. */
export const layerText = (l) => boundsOf(l, l.level).map((value) => valueText(l, value)).join(" to ");

const A = 6378137;
const E2 = (2 - 1 / 298.257223563) / 298.257223563;
const meridianRadius = (lat) => (A * (1 - E2)) / (1 - E2 * Math.sin(lat) ** 2) ** 1.5;

/** Latitude and longitude of a place near `origin`: the inverse transverse Mercator projection about it on WGS 84
 * (Snyder, USGS Professional Paper 1395, p. 63), as in the daemon's exports. */
export function toLatLon(origin, x, y) {
  const lat0 = (origin.lat_deg * Math.PI) / 180;
  let lat = lat0;
  for (let i = 0; i < 3; i += 1) lat = lat0 + y / meridianRadius((lat + lat0) / 2);
  const n = A / Math.sqrt(1 - E2 * Math.sin(lat) ** 2);
  const [t, d, c] = [Math.tan(lat), x / n, (E2 / (1 - E2)) * Math.cos(lat) ** 2];
  const north = lat - ((n * t) / meridianRadius(lat)) * (d ** 2 / 2 - ((5 + 3 * t * t + 10 * c) * d ** 4) / 24);
  const east = (d - ((1 + 2 * t * t + c) * d ** 3) / 6) / Math.cos(lat);
  return [(north * 180) / Math.PI, origin.lon_deg + (east * 180) / Math.PI];
}

function latLon(origin, x, y) {
  const [lat, lon] = toLatLon(origin, x, y);
  return `${Math.abs(lat).toFixed(6)}° ${lat < 0 ? "S" : "N"} ${Math.abs(lon).toFixed(6)}° ${lon < 0 ? "W" : "E"}`;
}
