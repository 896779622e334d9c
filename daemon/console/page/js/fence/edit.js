// Editing a plan on the map: add, drag and delete corners by pointer or by keys.

import { sendFence } from "../api.js";
import { Order } from "../order/order.js";
import { store } from "../store.js";
import { fromServer, toOrder } from "./plan.js";
import { snap } from "./polygon.js";

const REACH_PX = 14;
const STEP_PX = 10;

export const fenceOrder = new Order("fence", (v) => fromServer(v.fence), (v, value) => sendFence(v.id, toOrder(value())));

/** The tool of the next click on the map ("corner" | "return_point" | null), and the chosen corner. */
export const pen = { tool: null, outline: null, corner: null, shown: false };

store.on("select", () => pickTool(null));

/** Selects a tool, or none; clicks add corners to `outline`. */
export function pickTool(tool, outline = null) {
  Object.assign(pen, { tool, outline, corner: null });
  store.emit("edit");
}

export const plan = () => fenceOrder.value(store.vehicle);

function change(edit) {
  const next = structuredClone(plan());
  edit(next);
  fenceOrder.set(store.vehicle, next);
}

/** Begins an outline. There is at most one fence, and it is the first outline. */
export function begin(kind) {
  const { outlines } = plan();
  if (kind === "fence" && outlines[0]?.kind === "fence") return pickTool("corner", 0);
  change((p) => (kind === "fence" ? p.outlines.unshift({ kind, points: [] }) : p.outlines.push({ kind, points: [] })));
  return pickTool("corner", kind === "fence" ? 0 : plan().outlines.length - 1);
}

/** Ends drawing and drops outlines without corners. */
export function finish() {
  if (plan().outlines.some((o) => o.points.length === 0)) {
    change((p) => (p.outlines = p.outlines.filter((o) => o.points.length > 0)));
  }
  pickTool(null);
}

export function removeOutline(i) {
  pickTool(null);
  change((p) => p.outlines.splice(i, 1));
}

export function setReturnPoint(place) {
  change((p) => (p.returnPoint = place && snap(place)));
}

export function setCorner(i, k, place) {
  change((p) => (p.outlines[i].points[k] = snap(place)));
}

export function addCorner(i, k, place) {
  change((p) => p.outlines[i].points.splice(k, 0, snap(place)));
}

export function removeCorner(i, k) {
  change((p) => p.outlines[i].points.splice(k, 1));
  pen.corner = null;
  store.emit("edit");
}

/** A click on the map at (x, y) metres; true if it edited the plan. */
export function clickAt(x, y) {
  if (pen.tool === "return_point") {
    setReturnPoint([x, y]);
    pickTool(null);
    return true;
  }
  if (pen.tool !== "corner") return false;
  const { points } = plan().outlines[pen.outline];
  addCorner(pen.outline, points.length, [x, y]);
  pen.corner = points.length;
  store.emit("edit");
  return true;
}

/** The handlers of a press at (px, py) on a corner, the middle of a side or the return point; else null. */
export function grab(view, px, py) {
  if (!pen.shown || !store.vehicle) return null;
  const near = (p) => {
    const [x, y] = view.toScreen(...p);
    return Math.hypot(x - px, y - py) < REACH_PX;
  };
  const { outlines, returnPoint } = plan();
  for (const [i, { points }] of outlines.entries()) {
    const k = points.findIndex(near);
    if (k >= 0) return dragCorner(view, i, k);
  }
  if (pen.tool === null && returnPoint && near(returnPoint)) return { move: (x, y) => setReturnPoint(view.toWorld(x, y)), press() {} };
  if (pen.tool === null) return grabMiddle(view, outlines, near);
  return null;
}

function grabMiddle(view, outlines, near) {
  for (const [i, { points }] of outlines.entries()) {
    const k = points.findIndex((p, n) => points.length > 2 && near(middle(p, points[(n + 1) % points.length])));
    if (k < 0) continue;
    let drag = null;
    const move = (x, y) => {
      if (!drag) addCorner(i, k + 1, view.toWorld(x, y));
      drag ??= dragCorner(view, i, k + 1);
      drag.move(x, y);
    };
    return { move, press: () => addCorner(i, k + 1, middle(points[k], points[(k + 1) % points.length])) };
  }
  return null;
}

export const middle = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];

function dragCorner(view, i, k) {
  const choose = () => {
    if (pen.tool !== "corner") pen.outline = i;
    pen.corner = pen.outline === i ? k : null;
    store.emit("edit");
  };
  // Pressing the first corner of the outline being drawn closes it.
  const closes = pen.tool === "corner" && pen.outline === i && k === 0 && plan().outlines[i].points.length > 2;
  return { move: (x, y) => (choose(), setCorner(i, k, view.toWorld(x, y))), press: () => (closes ? finish() : choose()) };
}

/** Every corner of the plan, in the order in which keys select them. */
const corners = () => plan().outlines.flatMap((o, i) => o.points.map((_, k) => [i, k]));

function next(view, step) {
  const all = corners();
  if (all.length === 0) return;
  const at = all.findIndex(([i, k]) => i === pen.outline && k === pen.corner);
  const [i, k] = all[at < 0 ? 0 : (at + step + all.length) % all.length];
  Object.assign(pen, { outline: i, corner: k });
  if (pen.tool === "corner") pen.tool = null;
  const place = plan().outlines[i].points[k];
  if (!view.holds([...place, ...place])) view.centre(...place);
  store.emit("edit");
}

const chosen = () => (pen.shown && pen.corner !== null ? plan().outlines[pen.outline]?.points[pen.corner] : null);

function nudge(view, dx, dy) {
  const place = chosen();
  const step = Math.max(0.1, STEP_PX / view.scale);
  if (place) setCorner(pen.outline, pen.corner, [place[0] + dx * step, place[1] + dy * step]);
}

/** Keys on the map while the plan is edited. */
export function penKeys(view) {
  const drop = () => chosen() && removeCorner(pen.outline, pen.corner);
  return {
    n: () => pen.shown && next(view, 1), p: () => pen.shown && next(view, -1),
    Delete: drop, Backspace: drop,
    "Shift+ArrowLeft": () => nudge(view, -1, 0), "Shift+ArrowRight": () => nudge(view, 1, 0),
    "Shift+ArrowUp": () => nudge(view, 0, 1), "Shift+ArrowDown": () => nudge(view, 0, -1),
  };
}
