// Editing outlines on the map: add, drag and delete corners by pointer or by keys.

import { sendAreas, sendFence } from "../api.js";
import { Order } from "../order/order.js";
import { store } from "../store.js";
import { fromAreas, fromServer, toAreas, toOrder } from "./plan.js";
import { snap } from "./polygon.js";

const REACH_PX = 14;
const STEP_PX = 10;

export const fenceOrder = new Order("fence", (v) => fromServer(v.fence), (v, value) => sendFence(v.id, toOrder(value())));

export const areasOrder = new Order("areas", (v) => fromAreas(v.areas), (v, value) => sendAreas(v.id, toAreas(value())));

/** The weight of a new area. */
const NEW_WEIGHT = 0.5;

/**
 * The order that is edited, the tool of the next click on the map ("corner" | "return_point" | null), and the chosen corner.
 */
export const pen = { order: fenceOrder, tool: null, outline: null, corner: null, shown: false };

store.on("select", () => pickTool(fenceOrder, null));

/** Selects a tool for an order, or none; clicks add corners to `outline`. */
export function pickTool(order, tool, outline = null) {
  Object.assign(pen, { order, tool, outline, corner: null });
  store.emit("edit");
}

export const planOf = (order) => order.value(store.vehicle);

function change(order, edit) {
  const next = structuredClone(planOf(order));
  edit(next);
  order.set(store.vehicle, next);
}

/** Begins an outline. There is at most one fence, and it is the first outline. */
export function begin(order, kind) {
  const { outlines } = planOf(order);
  if (kind === "fence" && outlines[0]?.kind === "fence") return pickTool(order, "corner", 0);
  const outline = { kind, points: [], ...(kind === "area" && { weight: NEW_WEIGHT }) };
  change(order, (p) => (kind === "fence" ? p.outlines.unshift(outline) : p.outlines.push(outline)));
  return pickTool(order, "corner", kind === "fence" ? 0 : planOf(order).outlines.length - 1);
}

/** Ends drawing and drops outlines without corners. */
export function finish() {
  const { order } = pen;
  if (planOf(order).outlines.some((o) => o.points.length === 0)) {
    change(order, (p) => (p.outlines = p.outlines.filter((o) => o.points.length > 0)));
  }
  pickTool(order, null);
}

export function removeOutline(order, i) {
  pickTool(order, null);
  change(order, (p) => p.outlines.splice(i, 1));
}

export function setWeight(order, i, weight) {
  change(order, (p) => (p.outlines[i].weight = weight));
}

export function setReturnPoint(place) {
  change(fenceOrder, (p) => (p.returnPoint = place && snap(place)));
}

export function setCorner(order, i, k, place) {
  change(order, (p) => (p.outlines[i].points[k] = snap(place)));
}

export function addCorner(order, i, k, place) {
  change(order, (p) => p.outlines[i].points.splice(k, 0, snap(place)));
}

export function removeCorner(order, i, k) {
  change(order, (p) => p.outlines[i].points.splice(k, 1));
  pen.corner = null;
  store.emit("edit");
}

/** A click on the map at (x, y) metres; true if it edited the plan. */
export function clickAt(x, y) {
  const { order, tool, outline } = pen;
  if (tool === "return_point") {
    setReturnPoint([x, y]);
    pickTool(order, null);
    return true;
  }
  if (tool !== "corner") return false;
  const { points } = planOf(order).outlines[outline];
  addCorner(order, outline, points.length, [x, y]);
  pen.corner = points.length;
  store.emit("edit");
  return true;
}

/** The handlers of a press at (px, py) on a corner, the middle of a side or the return point; else null. */
export function grab(view, px, py) {
  if (!pen.shown || !store.vehicle || store.replay) return null;
  const near = (p) => {
    const [x, y] = view.toScreen(...p);
    return Math.hypot(x - px, y - py) < REACH_PX;
  };
  // While an outline is drawn, the corners of the other order are not in the way.
  const orders = pen.tool === null ? [fenceOrder, areasOrder] : [pen.order];
  for (const order of orders) {
    for (const [i, { points }] of planOf(order).outlines.entries()) {
      const k = points.findIndex(near);
      if (k >= 0) return dragCorner(view, order, i, k);
    }
  }
  if (pen.tool !== null) return null;
  const { returnPoint } = planOf(fenceOrder);
  if (returnPoint && near(returnPoint)) return { move: (x, y) => setReturnPoint(view.toWorld(x, y)), press() {} };
  return grabMiddle(view, fenceOrder, near) ?? grabMiddle(view, areasOrder, near);
}

function grabMiddle(view, order, near) {
  for (const [i, { points }] of planOf(order).outlines.entries()) {
    const k = points.findIndex((p, n) => points.length > 2 && near(middle(p, points[(n + 1) % points.length])));
    if (k < 0) continue;
    let drag = null;
    const move = (x, y) => {
      if (!drag) addCorner(order, i, k + 1, view.toWorld(x, y));
      drag ??= dragCorner(view, order, i, k + 1);
      drag.move(x, y);
    };
    return { move, press: () => addCorner(order, i, k + 1, middle(points[k], points[(k + 1) % points.length])) };
  }
  return null;
}

export const middle = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];

function dragCorner(view, order, i, k) {
  const choose = () => {
    if (pen.tool !== "corner") Object.assign(pen, { order, outline: i });
    pen.corner = pen.outline === i ? k : null;
    store.emit("edit");
  };
  // Pressing the first corner of the outline being drawn closes it.
  const closes = pen.tool === "corner" && pen.outline === i && k === 0 && planOf(order).outlines[i].points.length > 2;
  return { move: (x, y) => (choose(), setCorner(order, i, k, view.toWorld(x, y))), press: () => (closes ? finish() : choose()) };
}

/** Every corner of both plans, in the order in which keys select them. */
const corners = () =>
  [fenceOrder, areasOrder].flatMap((order) => planOf(order).outlines.flatMap((o, i) => o.points.map((_, k) => [order, i, k])));

function next(view, step) {
  const all = corners();
  if (all.length === 0) return;
  const at = all.findIndex(([order, i, k]) => order === pen.order && i === pen.outline && k === pen.corner);
  const [order, i, k] = all[at < 0 ? 0 : (at + step + all.length) % all.length];
  Object.assign(pen, { order, outline: i, corner: k });
  if (pen.tool === "corner") pen.tool = null;
  const place = planOf(order).outlines[i].points[k];
  if (!view.holds([...place, ...place])) view.centre(...place);
  store.emit("edit");
}

const chosen = () => (pen.shown && pen.corner !== null ? planOf(pen.order).outlines[pen.outline]?.points[pen.corner] : null);

function nudge(view, dx, dy) {
  const place = chosen();
  const step = Math.max(0.1, STEP_PX / view.scale);
  if (place) setCorner(pen.order, pen.outline, pen.corner, [place[0] + dx * step, place[1] + dy * step]);
}

/** Keys on the map while the plan is edited. */
export function penKeys(view) {
  const drop = () => chosen() && removeCorner(pen.order, pen.outline, pen.corner);
  return {
    n: () => pen.shown && next(view, 1), p: () => pen.shown && next(view, -1),
    Delete: drop, Backspace: drop,
    "Shift+ArrowLeft": () => nudge(view, -1, 0), "Shift+ArrowRight": () => nudge(view, 1, 0),
    "Shift+ArrowUp": () => nudge(view, 0, 1), "Shift+ArrowDown": () => nudge(view, 0, -1),
  };
}
