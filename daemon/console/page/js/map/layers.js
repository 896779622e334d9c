// The chosen layer of the map, its legend, and the canvases that hold painted tiles until they change.

import { $, h, show } from "../dom.js";
import { shownAs, tintOf } from "../book.js";
import { isStale, store } from "../store.js";
import { nice, span } from "../format.js";
import { ramp } from "../palette.js";
import { current as theme, onTheme } from "../theme.js";
import { EDGE } from "../tiles.js";
import { blocksOf, hasCoarse } from "./coarse.js";
import { FLOOR, FloorOver, floorKey, floorLegend, floorTone, hasFloor, loadFloor } from "./floor.js";
import { lookOf } from "./layer-look.js";
import { ageTones, footprintTones, labelTones, layerTones, paintTile, sampleTone } from "./raster.js";
import { NATURAL, NaturalOver, loadLooks, naturalEdits, naturalLegend, naturalTone, withoutImage } from "./natural.js";
import { TRUTH, truthInfo, truthLegend } from "./truth.js";

const AGE_REPAINT_S = 5;
/** Painted tiles that are kept of a map. */
const MAX_PAINTED = 4096;
const NO_BLOCKS = [];
export const layer = { name: "label", highlight: null };
/** The layer to which the keys T and L return. */
let before = "label";
const painted = new Map();
let legendKey = "";
let bookEdits = 0;
store.on("book select", () => (bookEdits += 1));
onTheme(() => {
  bookEdits += 1;
  legendKey = "";
});

/** The layers that can be shown: those of the chosen vehicle's map, and the true classes of a simulated sea floor. */
export function layerNames() {
  return ["label", NATURAL, ...(hasFloor() ? [FLOOR] : []), "age", ...(store.map?.layers.map((p) => p.name).sort() ?? []), ...(truthInfo() ? [TRUTH] : [])];
}

/** Changes between the layer `name` and the one that was shown before. */
export function toggleLayer(name) {
  const isShown = layer.name === name;
  if (!isShown) before = layer.name;
  setLayer(isShown ? before : name);
}

export function setLayer(name) {
  layer.name = layerNames().includes(name) ? name : "label";
  drawLegend();
}

/** How the tiles of a vehicle's map are painted: `canvasOf(tile)`, `toneOf(tile)` for tiles of a few pixels, and `drawOver(c, tile,
 * [x, y, side])` for what lies over a tile. A canvas is painted again only when its tile or the look changes. */
export function painterOf(vehicle, map) {
  const look = currentLook(vehicle, map);
  const paint = (tile) => {
    const blocks = look.isCoarse ? blocksOf(map, tile) : NO_BLOCKS;
    const kept = look.canvases.get(tile);
    if (kept?.blocks === blocks) return kept.canvas;
    if (look.canvases.size >= MAX_PAINTED) look.canvases.clear();
    const canvas = paintTile(tile, look.tones.cell, blocks, look.tones.label);
    look.canvases.set(tile, { blocks, canvas });
    return canvas;
  };
  forgetReplaced(look, map);
  return { canvasOf: paint, toneOf: (tile) => sampleTone(tile, look.tones.cell), drawOver: (c, tile, at) => look.over?.draw(c, vehicle, map, tile, at) };
}

/** The look of a vehicle's map, with the canvases that were painted in it. */
function currentLook(vehicle, map) {
  const chosen = vehicle.id === store.selectedId;
  const isNatural = chosen && layer.name === NATURAL;
  const isFloor = chosen && layer.name === FLOOR;
  if (isNatural) loadLooks(vehicle);
  if (isFloor) loadFloor(vehicle, map);
  const shown = map.layers.find((p) => p.name === layer.name);
  const nowS = layer.name === "age" ? Math.floor(store.nowS / AGE_REPAINT_S) * AGE_REPAINT_S : 0;
  const top = layer.name === "age" ? ageTop(map) : 0;
  const scale = shown ? JSON.stringify([shown.lowest, shown.edges, lookOf(shown).low, lookOf(shown).high]) : "";
  const edits = isNatural ? `${bookEdits}.${naturalEdits}` : bookEdits;
  const key = chosen
    ? `${map.epoch}.${layer.name}.${nowS}.${top}.${layer.highlight}.${isStale(vehicle)}.${edits}.${scale}`
    : `${map.epoch}.footprint`;
  const have = painted.get(vehicle.id);
  if (have?.key === key) return have;
  const look = { key, tones: tonesOf(vehicle, chosen, shown, nowS, top), canvases: new Map() };
  look.over = isNatural ? new NaturalOver(layer.highlight) : isFloor ? new FloorOver() : null;
  look.isCoarse = isNatural || isFloor || (chosen && layer.name === "label");
  painted.set(vehicle.id, look);
  return look;
}

/** Drops the canvases of tiles that a newer version of the map has replaced. */
function forgetReplaced(look, map) {
  if (look.map === map) return;
  look.map = map;
  for (const tile of look.canvases.keys()) {
    if (map.tileAt(tile.column * EDGE, tile.row * EDGE) !== tile) look.canvases.delete(tile);
  }
}

function tonesOf(vehicle, chosen, shown, nowS, top) {
  const tones = { [NATURAL]: (id) => naturalTone(vehicle, id), [FLOOR]: floorTone };
  const toneOf = (chosen && tones[layer.name]) || ((id) => [...tintOf(id), 255]);
  const label = labelTones({ toneOf, shownAs, stale: isStale(vehicle), highlight: layer.highlight });
  if (!chosen) return { label, cell: footprintTones() };
  if (shown) return { label, cell: layerTones(shown, isStale(vehicle)) };
  if (layer.name === "age") return { label, cell: ageTones(nowS, top) };
  return { label, cell: (tile, x, y, id) => label(id) };
}

/** The upper end of the age scale: a round number above the oldest cell. */
export function ageTop(map) {
  const oldest = Math.max(60, map.oldestS === null ? 0 : store.nowS - map.oldestS);
  const step = nice(oldest);
  return Math.ceil(oldest / step) * step;
}

function drawNaturalLegend() {
  const missing = withoutImage();
  const key = `${NATURAL}.${missing}`;
  if (key === legendKey) return;
  legendKey = key;
  show($("legend"), store.map !== null);
  $("legend").replaceChildren(...naturalLegend(missing));
}

function drawFloorLegend() {
  if (floorKey() === legendKey) return;
  legendKey = floorKey();
  show($("legend"), store.map !== null);
  $("legend").replaceChildren(...floorLegend());
}

function drawTruthLegend() {
  const key = JSON.stringify(truthInfo());
  if (key === legendKey) return;
  legendKey = key;
  show($("legend"), truthInfo() !== null);
  if (truthInfo()) $("legend").replaceChildren(...truthLegend());
}

const summaryOf = (name) => store.snapshot?.layers.find((l) => l.name === name)?.summary ?? "";

export function drawLegend() {
  const map = store.map;
  const shown = map?.layers.find((p) => p.name === layer.name);
  const top = layer.name === "age" && map ? ageTop(map) : 0;
  const coarse = layer.name === "label" && Boolean(map) && hasCoarse(map);
  if (layer.name === TRUTH) return drawTruthLegend();
  if (layer.name === NATURAL) return drawNaturalLegend();
  if (layer.name === FLOOR) return drawFloorLegend();
  const look = shown ? lookOf(shown) : { at: ramp, low: "now", high: span(top) };
  const key = `${layer.name}.${look.low}.${look.high}.${coarse}`;
  if (key === legendKey) return;
  legendKey = key;
  const box = $("legend");
  show(box, Boolean(map) && (layer.name !== "label" || coarse));
  if (box.hidden) return;
  if (coarse) {
    const words = `pale: one cell of 16 was sent, the others are unknown`;
    box.replaceChildren(h("span.pale", { "aria-hidden": "true" }), h("span", {}, words));
    return;
  }
  const bar = h("canvas", { width: 120, height: 8, "aria-hidden": "true" });
  const c = bar.getContext("2d");
  for (let x = 0; x < 120; x += 1) {
    c.fillStyle = `rgb(${look.at(shown ? x / 119 : 1 - x / 119, theme() === "red").join(" ")})`;
    c.fillRect(x, 0, 1, 8);
  }
  box.replaceChildren(h("b", { title: summaryOf(shown?.name) }, shown?.name ?? "age of cells"), h("span", {}, look.low.trim()), bar, h("span", {}, look.high.trim()));
}
