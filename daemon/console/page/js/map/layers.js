// The chosen layer of the map, its legend, and the canvases that hold painted maps until they change.

import { $, h, show } from "../dom.js";
import { shownAs, tintOf } from "../book.js";
import { isStale, store } from "../store.js";
import { nice, span } from "../format.js";
import { ramp } from "../palette.js";
import { current as theme, onTheme } from "../theme.js";
import { coarseBlocks, paintCoarse } from "./coarse.js";
import { lookOf } from "./layer-look.js";
import { labelTones, paintAge, paintFootprint, paintLabels, paintLayer } from "./raster.js";

const AGE_REPAINT_S = 5;
export const layer = { name: "label", highlight: null };
const painted = new Map();
let legendKey = "";
let bookEdits = 0;
store.on("book select", () => (bookEdits += 1));
onTheme(() => {
  bookEdits += 1;
  legendKey = "";
});

/** The layers that the chosen vehicle's map can show. */
export function layerNames() {
  return ["label", "age", ...(store.map?.layers.map((p) => p.name).sort() ?? [])];
}

export function setLayer(name) {
  layer.name = layerNames().includes(name) ? name : "label";
  drawLegend();
}

/** The canvas of a vehicle's map, painted again only when its key changes. */
export function canvasOf(vehicle, map) {
  const chosen = vehicle.id === store.selectedId;
  const shown = map.layers.find((p) => p.name === layer.name);
  const age = layer.name === "age" ? Math.floor((store.nowS - map.fetchedS) / AGE_REPAINT_S) * AGE_REPAINT_S : 0;
  const key = chosen
    ? `${map.epoch}.${map.version}.${layer.name}.${age}.${layer.highlight}.${isStale(vehicle)}.${bookEdits}`
    : `${map.epoch}.${map.version}.footprint`;
  const have = painted.get(vehicle.id);
  if (have?.key === key) return have.canvas;
  const canvas = !chosen
    ? paintFootprint(map)
    : shown
      ? paintLayer(map, shown, isStale(vehicle))
      : layer.name === "age"
        ? paintAge(map, age, ageTop(map))
        : paintLabels(map, { tintOf, shownAs, stale: isStale(vehicle), highlight: layer.highlight });
  painted.set(vehicle.id, { key, canvas });
  return canvas;
}

const coarsely = new Map();

/** The coarse blocks of a vehicle's map, painted pale below its cells in the label layer, or null. */
export function coarseCanvasOf(vehicle, map) {
  if (vehicle.id !== store.selectedId || layer.name !== "label" || coarseBlocks(map).length === 0) return null;
  const key = `${map.epoch}.${map.version}.${layer.highlight}.${isStale(vehicle)}.${bookEdits}`;
  const have = coarsely.get(vehicle.id);
  if (have?.key === key && have.map === map) return have.canvas;
  const tones = labelTones({ tintOf, shownAs, stale: isStale(vehicle), highlight: layer.highlight });
  const canvas = paintCoarse(map, tones);
  coarsely.set(vehicle.id, { key, map, canvas });
  return canvas;
}

/** The upper end of the age scale: a round number above the oldest cell. */
export function ageTop(map) {
  let oldest = 60;
  for (const a of map.age) if (a !== 65535 && a > oldest) oldest = a;
  const step = nice(oldest);
  return Math.ceil(oldest / step) * step;
}

const summaryOf = (name) => store.snapshot?.layers.find((l) => l.name === name)?.summary ?? "";

export function drawLegend() {
  const map = store.map;
  const shown = map?.layers.find((p) => p.name === layer.name);
  const top = layer.name === "age" && map ? ageTop(map) : 0;
  const coarse = layer.name === "label" && Boolean(map) && coarseBlocks(map).length > 0;
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
