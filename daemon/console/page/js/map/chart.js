// The operator's map: draws layers, overlays and vehicles on the canvas after each change.

import { $, show, text } from "../dom.js";
import { ago, count, span } from "../format.js";
import { recall, remember } from "../prefs.js";
import { ageOf, isStale, store } from "../store.js";
import { colour, onTheme } from "../theme.js";
import { EDGE, extent } from "../tiles.js";
import { drawOutlines } from "../fence/draw.js";
import { clickAt, finish, grab, pen, penKeys } from "../fence/edit.js";
import { drawVehicle, drawSurface } from "./vehicle-marker.js";
import { boxInWorld, inWorld, viewOf } from "./frames.js";
import { listen } from "./input.js";
import { drawLegend, layer, painterOf, toggleLayer } from "./layers.js";
import { NATURAL } from "./natural.js";
import { addPoint, drawMeasure, measure, toggleMeasure } from "./measure.js";
import { drawGrid, drawNorth, drawRings, drawScaleBar } from "./overlays.js";
import { showReadout } from "./readout.js";
import { drawDestination } from "./destination.js";
import { choosePlace, chosen, clearPlace, drawPlaces } from "./place.js";
import { drawDryRun } from "./dry-run.js";
import { TRUTH, drawTruth } from "./truth.js";
import { View } from "./view.js";
import { pathOf } from "./path.js";

export const view = new View();
export const options = { grid: recall("grid", true), rings: recall("rings", false) };
const MAX_FIT_RATIO = 4;
/** Tiles smaller than this are drawn in one colour, at least as large as a mark. */
const MIN_TILE_PX = 4;
const MIN_MARK_PX = 2;
const canvas = $("chart");
let ink = {};
let dirty = false;
let pointer = null;

export function startChart() {
  new ResizeObserver(resize).observe(canvas.parentElement);
  onTheme(readInk);
  readInk();
  listen(canvas, view, {
    changed: () => (redraw(), store.emit("view")),
    point: hover,
    click,
    grab: (px, py) => (measure.on ? null : grab(view, px, py)),
    keys: { ...penKeys(view), 0: fit, f: follow, F: follow, m: measureKey, M: measureKey, t: layerKey(TRUTH), T: layerKey(TRUTH), l: layerKey(NATURAL), L: layerKey(NATURAL), Escape: end, Enter: () => click(view.width / 2, view.height / 2) },
  });
  canvas.addEventListener("focus", redraw);
  canvas.addEventListener("blur", redraw);
  store.on("state map select feed book highlight tick edit natural place", () => {
    keepInView();
    redraw();
  });
}

export function redraw() {
  if (dirty) return;
  dirty = true;
  requestAnimationFrame(() => {
    dirty = false;
    draw();
  });
}

export function fit() {
  view.mode = "fit";
  const all = bounds();
  if (all) view.fit(all);
  store.emit("view");
  redraw();
}

export function follow() {
  view.mode = view.mode === "follow" ? "free" : "follow";
  keepInView();
  store.emit("view");
  redraw();
}

export function toggle(option) {
  options[option] = !options[option];
  remember(option, options[option]);
  redraw();
}

function end() {
  if (pen.tool) finish();
  else if (measure.on) measureKey();
  else if (chosen.at) clearPlace();
}

function measureKey() {
  toggleMeasure();
  store.emit("view");
}

const layerKey = (name) => () => {
  toggleLayer(name);
  store.emit("view");
};

function keepInView() {
  if (pen.tool && view.mode !== "free") {
    view.mode = "free";
    store.emit("view");
  }
  const s = store.vehicle?.status;
  if (view.mode === "follow" && s) view.centre(...inWorld(store.vehicle, s.x_m, s.y_m));
  const all = view.mode === "fit" ? bounds() : null;
  if (all && (!view.holds(all) || !fitted)) {
    view.fit(all);
    fitted = true;
  }
}
let fitted = false;

/** The box that Fit shows: every map, every vehicle and its planned path; fences and the surface as well, unless the map would become tiny. */
function bounds() {
  const boxes = [];
  for (const v of store.snapshot?.vehicles ?? []) {
    const s = v.status;
    const map = store.maps.get(v.id);
    const own = [map && extent(map), s && [s.x_m - 4, s.y_m - 4, s.x_m + 4, s.y_m + 4], ...(s ? pathOf(s).map(([x, y]) => [x, y, x, y]) : [])];
    boxes.push(...own.filter(Boolean).map((box) => boxInWorld(v, box)));
  }
  if (boxes.length === 0) return store.snapshot ? [-10, -10, 10, 10] : null;
  const near = around(boxes);
  const surface = surfaceAt();
  const corners = (store.snapshot?.vehicles ?? []).flatMap((v) => v.fence?.fence ?? []);
  const further = [...corners, ...(surface ? [[surface.x_m, surface.y_m]] : [])];
  const all = around([near, ...further.map(([x, y]) => [x, y, x, y])]);
  return reach(all) <= MAX_FIT_RATIO * reach(near) ? all : near;
}

const around = (boxes) => boxes.reduce((a, b) => [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[2], b[2]), Math.max(a[3], b[3])]);
const reach = ([west, south, east, north]) => Math.max(east - west, north - south);

function readInk() {
  for (const name of ["sea", "text", "grid", "vehicle", "track", "stale", "accent", "fence", "keepout", "bad", "reason-label", "reason-expected", "reason-unseen", "reason-return", "reason-other"]) ink[name] = colour(`map-${name}`);
  redraw();
}

function resize() {
  const box = canvas.parentElement.getBoundingClientRect();
  const ratio = devicePixelRatio || 1;
  canvas.width = Math.round(box.width * ratio);
  canvas.height = Math.round(box.height * ratio);
  view.resize(box.width, box.height);
  if (view.mode === "fit") fit();
  draw();
}

function hover(px, py) {
  pointer = px === null ? null : [px, py];
  measure.pointer = pointer && view.toWorld(...pointer);
  if (measure.on) redraw();
  else readout();
}

function click(px, py) {
  if (clickAt(...view.toWorld(px, py))) return;
  if (!measure.on) return choosePlace(view, px, py);
  addPoint(...view.toWorld(px, py));
  redraw();
}

const byKeys = () => canvas.matches(":focus-visible") && pointer === null;

function readout() {
  if (pointer) showReadout(view.toWorld(...pointer));
  else showReadout(byKeys() ? [view.east, view.north] : null);
}

function draw() {
  const c = canvas.getContext("2d");
  const ratio = devicePixelRatio || 1;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.fillStyle = ink.sea;
  c.fillRect(0, 0, view.width, view.height);
  const vehicles = store.snapshot?.vehicles ?? [];
  const byChoice = [...vehicles].sort((a, b) => (a.id === store.selectedId) - (b.id === store.selectedId));
  if (layer.name === TRUTH) drawTruth(c, view, redraw);
  else for (const v of byChoice) drawMap(c, v);
  if (options.grid) drawGrid(c, view, ink);
  const surface = surfaceAt();
  const s = store.vehicle?.status;
  const centre = surface ? [surface.x_m, surface.y_m] : s && inWorld(store.vehicle, s.x_m, s.y_m);
  if (options.rings && centre) drawRings(c, view, ink, ...centre);
  if (surface) drawSurface(c, view, ink, surface);
  for (const v of byChoice) drawOutlines(c, view, ink, v, v.id === store.selectedId);
  for (const v of byChoice) drawDestination(c, view, ink, v);
  for (const v of byChoice) drawVehicle(c, viewOf(view, v), ink, v, v.id === store.selectedId);
  if (store.vehicle) drawDryRun(c, viewOf(view, store.vehicle), ink, store.vehicle);
  drawPlaces(c, view, ink);
  drawMeasure(c, view, ink);
  if (byKeys()) drawCross(c);
  drawScaleBar(c, view, ink);
  drawNorth(c, view, ink);
  drawLegend();
  plates();
  readout();
}

/** The position of the surface while its GPS fix is valid, or null. */
function surfaceAt() {
  const p = store.snapshot?.position;
  return p?.is_valid && p.x_m !== null ? p : null;
}

/** Draws the tiles in view. Edges lie on whole pixels, so that neighbours leave no gap. */
function drawMap(c, vehicle) {
  const map = store.maps.get(vehicle.id);
  if (!map || map.isEmpty) return;
  const painter = painterOf(vehicle, map);
  const side = EDGE * map.cell_m;
  const size = side * view.scale;
  const [left, top] = view.toScreen(...inWorld(vehicle, 0, 0));
  c.imageSmoothingEnabled = size / EDGE < 1;
  const ratio = devicePixelRatio || 1;
  const whole = (v) => Math.round(v * ratio) / ratio;
  for (const tile of map.tiles.values()) {
    const x = left + tile.column * size;
    const y = top - (tile.row + 1) * size;
    if (x > view.width || y > view.height || x + size < 0 || y + size < 0) continue;
    if (size < MIN_TILE_PX) drawSmall(c, painter.toneOf(tile), x, y, size);
    else {
      const [west, north] = [whole(x), whole(y)];
      c.drawImage(painter.canvasOf(tile), west, north, whole(x + size) - west, whole(y + size) - north);
      painter.drawOver(c, tile, [west, north, whole(x + size) - west]);
    }
  }
}

/** A tile of a few pixels, in one colour and large enough to be seen. */
function drawSmall(c, tone, x, y, size) {
  if (!tone) return;
  const [red, green, blue, alpha] = tone;
  c.fillStyle = `rgb(${Math.round(red)} ${Math.round(green)} ${Math.round(blue)} / ${alpha / 255})`;
  const side = Math.max(size, MIN_MARK_PX);
  c.fillRect(x + (size - side) / 2, y + (size - side) / 2, side, side);
}

function drawCross(c) {
  const [x, y] = [view.width / 2, view.height / 2];
  c.strokeStyle = ink.text;
  c.lineWidth = 1;
  c.beginPath();
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    c.moveTo(x + 4 * dx, y + 4 * dy);
    c.lineTo(x + 14 * dx, y + 14 * dy);
  }
  c.stroke();
}

/** Why a map is empty at a moment of a record. */
const EMPTY_THEN = {
  operator: () => "No cell of the map had arrived by this moment.",
  vehicle: (v) => `${v.name} had no map at this moment.`,
  difference: () => "No cell differs at this moment.",
};
/** Whose map a record shows. */
const SIDES = { operator: "Operator's map", vehicle: "Vehicle's map", difference: "Differing cells" };

/** What an empty map shows soon. */
function emptyText(v) {
  if (store.replay) return EMPTY_THEN[store.replay.side](v);
  const when = `a frame is expected every ${span(v.expected_interval_s)}.`;
  if (v.last_received_s === null) return `No frame received from ${v.name} yet. Its position and its map appear here with the first frames; ${when}`;
  return `No cell of the map has arrived yet. The map appears here while ${v.name} surveys; ${when}`;
}

function plates() {
  const v = store.vehicle;
  show($("map-empty"), Boolean(v) && v.map.explored_cells === 0);
  if (v) text($("map-empty"), emptyText(v));
  show($("map-age"), Boolean(v));
  if (!v) return;
  const age = ageOf(v.map.updated_s);
  const late = isStale(v);
  $("map-age").classList.toggle("stale", late);
  const state = late ? `stale, changed ${ago(age)}` : age === null ? "no data yet" : `changed ${span(age)} ago`;
  const which = store.replay ? SIDES[store.replay.side] : `Map v${v.map.version}`;
  text($("map-age"), `${which} · ${state} · ${count(v.map.explored_cells)} cells`);
  canvas.dataset.layer = layer.name;
}
