// Editing a plan on the map: click to add corners, drag them, delete them; the same by keys.

import { sendFence } from "../api.js";
import { Order } from "../panel/order.js";
import { store } from "../store.js";
import { fromServer, toOrder } from "./plan.js";
import { snap } from "./polygon.js";

const REACH_PX = 14;
const STEP_PX = 10;

/** The fence of each vehicle: sent, edited, on its way. */
export const fenceOrder = new Order("fence", (v) => fromServer(v.fence), (v, plan) => sendFence(v.id, toOrder(plan)));

/** What the next click on the map does ("corner" | "home" | null), and which corner is chosen. */
export const pen = { tool: null, outline: null, corner: null, shown: false };

store.on("select", () => put(null));

/** Takes up a tool, or lays it down; `outline` is the one that clicks add corners to. */
export function put(tool, outline = null) {
  Object.assign(pen, { tool, outline, corner: null });
  store.tell("draft");
}

export const plan = () => fenceOrder.value(store.vehicle);

function change(edit) {
  const next = structuredClone(plan());
  edit(next);
  fenceOrder.set(store.vehicle, next);
}

/** Begins an outline; there is one fence at most, and it comes first. */
export function begin(kind) {
  const { outlines } = plan();
  if (kind === "fence" && outlines[0]?.kind === "fence") return put("corner", 0);
  change((p) => (kind === "fence" ? p.outlines.unshift({ kind, points: [] }) : p.outlines.push({ kind, points: [] })));
  return put("corner", kind === "fence" ? 0 : plan().outlines.length - 1);
}

/** Ends drawing; an outline without corners is dropped. */
export function finish() {
  if (plan().outlines.some((o) => o.points.length === 0)) {
    change((p) => (p.outlines = p.outlines.filter((o) => o.points.length > 0)));
  }
  put(null);
}

export function removeOutline(i) {
  put(null);
  change((p) => p.outlines.splice(i, 1));
}

export function setHome(home) {
  change((p) => (p.home = home && snap(home)));
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
  store.tell("draft");
}

/** A press on the map at (x, y) metres that did not pan; true if it was for the plan. */
export function clickAt(x, y) {
  if (pen.tool === "home") {
    setHome([x, y]);
    put(null);
    return true;
  }
  if (pen.tool !== "corner") return false;
  const { points } = plan().outlines[pen.outline];
  addCorner(pen.outline, points.length, [x, y]);
  pen.corner = points.length;
  store.tell("draft");
  return true;
}

/** What lies under a press: a corner, the middle of a side, the return point; then how to drag it. */
export function grab(view, px, py) {
  if (!pen.shown || !store.vehicle) return null;
  const near = (p) => {
    const [x, y] = view.toScreen(...p);
    return Math.hypot(x - px, y - py) < REACH_PX;
  };
  const { outlines, home } = plan();
  for (const [i, { points }] of outlines.entries()) {
    const k = points.findIndex(near);
    if (k >= 0) return dragCorner(view, i, k);
  }
  if (pen.tool === null && home && near(home)) return { move: (x, y) => setHome(view.toWorld(x, y)), press() {} };
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
    store.tell("draft");
  };
  // Pressing the first corner of the outline being drawn closes it.
  const closes = pen.tool === "corner" && pen.outline === i && k === 0 && plan().outlines[i].points.length > 2;
  return { move: (x, y) => (choose(), setCorner(i, k, view.toWorld(x, y))), press: () => (closes ? finish() : choose()) };
}

/** Every corner of the plan in order, for going through them by keys. */
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
  store.tell("draft");
}

const chosen = () => (pen.shown && pen.corner !== null ? plan().outlines[pen.outline]?.points[pen.corner] : null);

function nudge(view, dx, dy) {
  const place = chosen();
  const step = Math.max(0.1, STEP_PX / view.scale);
  if (place) setCorner(pen.outline, pen.corner, [place[0] + dx * step, place[1] + dy * step]);
}

/** Keys on the map while the plan is shown for editing. */
export function penKeys(view) {
  const drop = () => chosen() && removeCorner(pen.outline, pen.corner);
  return {
    n: () => pen.shown && next(view, 1), p: () => pen.shown && next(view, -1),
    Delete: drop, Backspace: drop,
    "Shift+ArrowLeft": () => nudge(view, -1, 0), "Shift+ArrowRight": () => nudge(view, 1, 0),
    "Shift+ArrowUp": () => nudge(view, 0, 1), "Shift+ArrowDown": () => nudge(view, 0, -1),
  };
}
