// The 3-D view: the map as a coloured point cloud in place of the flat chart.

import { $, h, show, text } from "../dom.js";
import { metres } from "../format.js";
import { rgb } from "../palette.js";
import { tintOf } from "../book.js";
import { layer, toggleLayer } from "../map/layers.js";
import { NATURAL, loadLooks, naturalTone } from "../map/natural.js";
import { isStale, store } from "../store.js";
import { colour, onTheme } from "../theme.js";
import { extent } from "../tiles.js";
import { Orbit } from "./orbit.js";
import { cellPoints, vehicleShape, depthLayer, gridLines, meanHeight } from "./points.js";
import { Renderer } from "./renderer.js";

export const cloud = { on: false };
const orbit = new Orbit();
const canvas = h("canvas", { id: "cloud", tabIndex: 0, role: "application", hidden: true,
  "aria-label": "Point cloud. Arrow keys turn, plus and minus zoom, L changes the colours." });
const note = h("p.plate", { id: "cloud-note", hidden: true });
let renderer = null;
let built = null;
/** The points of tiles in their present colours. */
let points = new WeakMap();
let framed = null;
let dirty = false;

export function startCloud() {
  $("stage").append(canvas, note);
  steer();
  new ResizeObserver(redraw).observe(canvas);
  onTheme(recolour);
  store.on("map", rebuild);
  store.on("select book natural", recolour);
  store.on("state feed", redraw);
}

/** Shows or hides the cloud; without WebGL it stays hidden and a note gives the reason. */
export function toggleCloud() {
  cloud.on = !cloud.on;
  try {
    if (cloud.on) renderer ??= new Renderer(canvas);
    show(canvas, cloud.on);
  } catch (error) {
    text(note, error.message);
  }
  show(note, cloud.on);
  for (const id of ["chart", "legend", "readout"]) $(id).classList.toggle("under", cloud.on);
  rebuild();
}

/** The zoom and fit buttons act on the cloud while it is shown. */
export function zoomCloud(factor) {
  orbit.zoom(factor);
  redraw();
}

export function fitCloud() {
  framed = null;
  rebuild();
}

function toggleNatural() {
  toggleLayer(NATURAL);
  recolour();
  store.emit("view");
}

function recolour() {
  points = new WeakMap();
  rebuild();
}

function rebuild() {
  built = null;
  redraw();
}

function redraw() {
  if (!cloud.on || !renderer || dirty) return;
  dirty = true;
  requestAnimationFrame(() => {
    dirty = false;
    if (cloud.on) draw();
  });
}

function build(map) {
  const isNatural = layer.name === NATURAL;
  if (isNatural) loadLooks(store.vehicle);
  const cells = cellPoints(map, isNatural ? (id) => naturalTone(store.vehicle, id).slice(0, 3) : tintOf, points);
  const floor = meanHeight(cells.places);
  const box = extent(map) ?? [-5, -5, 5, 5];
  const flat = depthLayer(map) === null;
  const low = flat ? floor - 0.05 : Math.min(floor, ...sample(cells.places)) - 0.5;
  const grid = gridLines(box, low, mixHex(colour("map-text"), colour("map-sea")));
  renderer.set("cells", "POINTS", cells.places, cells.tints);
  renderer.set("grid", "LINES", grid.places, grid.tints);
  if (framed !== store.selectedId && cells.places.length > 0) {
    orbit.frame(box, floor);
    framed = store.selectedId;
  }
  text(note, `Grid ${metres(grid.step, 0)}. ${flat ? "The vehicle sends no depths: the cells are shown flat." : "Heights are to scale."}${isNatural ? " Colours: an illustration made of images; key L: the colours of the labels." : ""}`);
  return { floor, flat };
}

function draw() {
  const { map, vehicle } = store;
  if (!map || !vehicle) return;
  built ??= build(map);
  const marker = vehicleShape(vehicle, built.floor, built.flat, colour(isStale(vehicle) ? "map-stale" : "map-text"));
  renderer.set("vehicle", "LINES", marker.lines.places, marker.lines.tints);
  renderer.set("hull", "TRIANGLES", marker.hull.places, marker.hull.tints);
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map((v) => Math.max(1, Math.round(v)));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const { matrix, pixels } = orbit.matrix(width, height);
  renderer.draw(matrix, pixels * map.cell_m * 1.2, rgb(colour("map-sea")));
}

function steer() {
  const fingers = new Map();
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      orbit.zoom(Math.hypot(event.clientX - other[0], event.clientY - other[1]) / Math.max(1, Math.hypot(before[0] - other[0], before[1] - other[1])));
      orbit.slide(dx / 2, dy / 2, canvas.clientHeight);
    } else if (event.shiftKey || event.buttons === 2) orbit.slide(dx, dy, canvas.clientHeight);
    else orbit.turn(dx, dy);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    redraw();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    orbit.zoom(Math.exp(-event.deltaY * 0.0016));
    redraw();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const act = {
      ArrowLeft: () => orbit.turn(20, 0), ArrowRight: () => orbit.turn(-20, 0),
      ArrowUp: () => orbit.turn(0, 15), ArrowDown: () => orbit.turn(0, -15),
      "+": () => orbit.zoom(1.2), "=": () => orbit.zoom(1.2), "-": () => orbit.zoom(1 / 1.2), l: toggleNatural, L: toggleNatural,
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
    redraw();
  });
}

/** Every hundredth height: enough for the lowest without spreading a huge array. */
function sample(places) {
  const heights = [];
  for (let i = 2; i < places.length; i += 300) heights.push(places[i]);
  return heights;
}

function mixHex(a, b) {
  const [x, y] = [rgb(a), rgb(b)];
  return `#${x.map((v, i) => Math.round(0.3 * v + 0.7 * y[i]).toString(16).padStart(2, "0")).join("")}`;
}
