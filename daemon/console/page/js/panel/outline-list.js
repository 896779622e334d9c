// The outlines of an order as a list: their corners as numbers, their faults, the weights of areas.

import { $, announce, h, keyed, show, text } from "../dom.js";
import { addCorner, middle, pen, pickTool, planOf, removeCorner, removeOutline, setCorner, setWeight } from "../fence/edit.js";
import { faults, nameOutline } from "../fence/plan.js";
import { signed } from "../format.js";

const latest = new WeakMap();

/** Moves the focus to the map, where the tool that `select` picks is used. */
export function onMap(select) {
  select();
  $("chart").focus({ preventScroll: true });
}

/** Two number fields for a place in metres; `set([x, y])` when both are numbers. */
export function place(name, set) {
  const field = (axis) => h("input", { type: "number", step: 0.1, "aria-label": `${name}, metres ${axis}`, oninput: change });
  const [east, north] = [field("east"), field("north")];
  function change() {
    const p = [east.valueAsNumber, north.valueAsNumber];
    if (p.every(Number.isFinite)) set(p);
  }
  const node = h("div.place", {}, h("span.axis", { "aria-hidden": "true" }, "E"), east, h("span.axis", { "aria-hidden": "true" }, "N"), north);
  const update = (p) => [east, north].forEach((f, n) => {
    if (f.valueAsNumber !== p[n] && document.activeElement !== f) f.value = p[n];
  });
  return { node, update };
}

/** The list of the outlines of an order; `update()` refreshes it. */
export function outlineList(order) {
  const node = h("ul.outlines");
  const open = new Set();
  const refresh = () => update();

  function update() {
    const plan = planOf(order);
    const wrong = faults(plan).outlines;
    const rows = plan.outlines.map((outline, i) => ({ outline, i, name: nameOutline(plan, i), fault: wrong[i] }));
    keyed(node, rows, (o) => o.i, () => makeOutline(order, open, refresh), (row, of) => refreshOutline(row, of, order, open));
  }
  return { node, update };
}

function makeOutline(order, open, refresh) {
  const node = h("li.outline");
  const at = () => latest.get(node);
  const corners = h("ol.corners");
  const more = h("button.quiet", { type: "button", onclick: () => (open.delete(at()) || open.add(at()), refresh()) });
  const title = h("b");
  const draw = h("button.undo", { type: "button", onclick: () => onMap(() => pickTool(order, "corner", at())) }, "Add corners");
  const drop = h("button.undo", { type: "button", onclick: () => removeOutline(order, at()) }, "Delete");
  const slider = h("input", { type: "range", min: -1, max: 1, step: 0.1, oninput: () => setWeight(order, at(), slider.valueAsNumber) });
  const amount = h("output");
  const weight = h("div.weight", {}, slider, amount);
  const fault = h("p.error", { role: "alert" });
  node.append(h("div.head", {}, title, more, draw, drop), weight, corners, fault);
  node.parts = { corners, more, title, draw, drop, fault, weight, slider, amount };
  return node;
}

function refreshOutline(node, { outline, i, name, fault }, order, open) {
  latest.set(node, i);
  const { corners, more, title, draw, drop, fault: faultLine, weight, slider, amount } = node.parts;
  const n = outline.points.length;
  text(title, name);
  text(more, `${n} ${n === 1 ? "corner" : "corners"}`);
  more.setAttribute("aria-expanded", String(open.has(i)));
  more.setAttribute("aria-label", `${name}: ${n} ${n === 1 ? "corner" : "corners"}, as numbers`);
  draw.setAttribute("aria-label", `Add corners to ${name} on the map`);
  drop.setAttribute("aria-label", `Delete ${name}`);
  show(weight, outline.kind === "area");
  if (outline.kind === "area") {
    slider.setAttribute("aria-label", `Weight of ${name}`);
    if (document.activeElement !== slider) slider.value = outline.weight;
    text(amount, signed(outline.weight));
  }
  show(faultLine, fault !== null);
  text(faultLine, fault ?? "");
  show(corners, open.has(i));
  const rows = open.has(i) ? outline.points.map((p, k) => ({ p, k })) : [];
  keyed(corners, rows, (r) => `${i}.${r.k}`, (r) => makeCorner(order, i, r.k, name), (row, of) => refreshCorner(row, of, order));
}

function makeCorner(order, i, k, name) {
  const fields = place(`${name}, corner ${k + 1}`, (p) => setCorner(order, i, k, p));
  const after = h("button.undo", { type: "button", title: "Add a corner after this one", onclick: () => {
    const { points } = planOf(order).outlines[i];
    addCorner(order, i, k + 1, middle(points[k], points[(k + 1) % points.length]));
  } }, "+");
  after.setAttribute("aria-label", `Add a corner after corner ${k + 1} of ${name}`);
  const drop = h("button.undo", { type: "button", onclick: () => (removeCorner(order, i, k), announce(`Corner ${k + 1} deleted`)) }, "\u00d7");
  drop.setAttribute("aria-label", `Delete corner ${k + 1} of ${name}`);
  const node = h("li", {}, h("span.axis", {}, String(k + 1)), fields.node, after, drop);
  node.fields = fields;
  return node;
}

function refreshCorner(node, { p, k }, order) {
  node.fields.update(p);
  const i = latest.get(node.closest(".outline"));
  node.classList.toggle("chosen", pen.order === order && pen.corner === k && pen.outline === i);
}
