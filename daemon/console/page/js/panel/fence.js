// The fence in the panel: its outlines, their corners as numbers, their faults, sending.

import { $, announce, h, keyed, show, text } from "../dom.js";
import { addCorner, begin, fenceOrder, finish, middle, pen, pickTool, plan, removeCorner, removeOutline, setCorner, setReturnPoint } from "../fence/edit.js";
import { faults, fromServer, isSound, nameOutline } from "../fence/plan.js";
import { metres } from "../format.js";
import { orderFoot } from "../order/foot.js";
import { slotOf } from "../order/status.js";
import { store } from "../store.js";

const list = h("ul.outlines");
const hint = h("p.hint", { role: "status" });
const state = h("p.note");
const frame = h("p.note");
const tools = {
  fence: h("button", { type: "button", onclick: () => onMap(() => begin("fence")) }, "Draw fence"),
  keepOut: h("button", { type: "button", onclick: () => onMap(() => begin("keep_out")) }, "Add keep-out"),
  returnPoint: h("button", { type: "button", onclick: () => onMap(() => pickTool(pen.tool === "return_point" ? null : "return_point")) }, "Place return point"),
  done: h("button.primary", { type: "button", onclick: finish }, "Done drawing"),
};
const editInForce = h("button.undo", { type: "button", onclick: () => fenceOrder.set(store.vehicle, fromServer(store.vehicle.fence_in_force.order)) }, "Edit the fence in force");
const returnFields = place("Return point", (p) => setReturnPoint(p));
const clearReturn = h("button.undo", { type: "button", onclick: () => setReturnPoint(null) }, "Remove");
clearReturn.setAttribute("aria-label", "Remove the return point");
const returnFault = h("p.error", { role: "alert" });
const returnBox = h("div.outline", {}, h("div.head", {}, h("b", {}, "Return point"), clearReturn), returnFields.node, returnFault);
const foot = orderFoot(fenceOrder, "Fence", "send-fence");
const latest = new WeakMap();
const open = new Set();

export const fencePart = h("section.part", { "aria-labelledby": "fence-title" },
  h("h3", { id: "fence-title" }, "Fence, keep-outs, return point"), state, editInForce, frame,
  h("div.buttons", {}, tools.fence, tools.keepOut, tools.returnPoint, tools.done), hint, list, returnBox, foot.node);

/** Selects a tool and moves the focus to the map, where it is used. */
function onMap(select) {
  select();
  $("chart").focus({ preventScroll: true });
}

/** Two number fields for a place in metres; `set([x, y])` when both are numbers. */
function place(name, set) {
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

function makeOutline() {
  const node = h("li.outline");
  const at = () => latest.get(node);
  const corners = h("ol.corners");
  const more = h("button.quiet", { type: "button", onclick: () => flip(at()) });
  const title = h("b");
  const draw = h("button.undo", { type: "button", onclick: () => onMap(() => pickTool("corner", at())) }, "Add corners");
  const drop = h("button.undo", { type: "button", onclick: () => removeOutline(at()) }, "Delete");
  const fault = h("p.error", { role: "alert" });
  node.append(h("div.head", {}, title, more, draw, drop), corners, fault);
  node.parts = { corners, more, title, draw, drop, fault };
  return node;
}

function flip(i) {
  if (!open.delete(i)) open.add(i);
  update();
}

function refreshOutline(node, { outline, i, name, fault }) {
  latest.set(node, i);
  const { corners, more, title, draw, drop, fault: faultLine } = node.parts;
  const n = outline.points.length;
  text(title, name);
  text(more, `${n} ${n === 1 ? "corner" : "corners"}`);
  more.setAttribute("aria-expanded", String(open.has(i)));
  more.setAttribute("aria-label", `${name}: ${n} ${n === 1 ? "corner" : "corners"}, as numbers`);
  draw.setAttribute("aria-label", `Add corners to ${name} on the map`);
  drop.setAttribute("aria-label", `Delete ${name}`);
  show(faultLine, fault !== null);
  text(faultLine, fault ?? "");
  show(corners, open.has(i));
  const rows = open.has(i) ? outline.points.map((p, k) => ({ p, k })) : [];
  keyed(corners, rows, (r) => `${i}.${r.k}`, (r) => makeCorner(i, r.k, name), refreshCorner);
}

function makeCorner(i, k, name) {
  const fields = place(`${name}, corner ${k + 1}`, (p) => setCorner(i, k, p));
  const after = h("button.undo", { type: "button", title: "Add a corner after this one", onclick: () => {
    const { points } = plan().outlines[i];
    addCorner(i, k + 1, middle(points[k], points[(k + 1) % points.length]));
  } }, "+");
  after.setAttribute("aria-label", `Add a corner after corner ${k + 1} of ${name}`);
  const drop = h("button.undo", { type: "button", onclick: () => (removeCorner(i, k), announce(`Corner ${k + 1} deleted`)) }, "\u00d7");
  drop.setAttribute("aria-label", `Delete corner ${k + 1} of ${name}`);
  const node = h("li", {}, h("span.axis", {}, String(k + 1)), fields.node, after, drop);
  node.fields = fields;
  return node;
}

function refreshCorner(node, { p, k }) {
  node.fields.update(p);
  node.classList.toggle("chosen", pen.corner === k && pen.outline === latest.get(node.closest(".outline")));
}

const HINTS = {
  corner: "Click the map for each corner; click the first corner again, or Done, to close the outline. Keys: Enter sets a corner at the cross, Escape ends.",
  return_point: "Click the map at the point to which the vehicle should return. Keys: Enter sets it at the cross.",
};

export function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const { outlines, returnPoint } = plan();
  if (pen.tool === "corner" && !outlines[pen.outline]) pickTool(null);
  const wrong = faults(plan());
  foot.update(vehicle, !isSound(plan()));
  text(tools.fence, outlines[0]?.kind === "fence" ? "Extend fence" : "Draw fence");
  tools.returnPoint.setAttribute("aria-pressed", String(pen.tool === "return_point"));
  for (const [name, node] of Object.entries(tools)) show(node, (name === "done") === (pen.tool === "corner"));
  text(hint, HINTS[pen.tool] ?? (outlines.length > 0 ? "Drag corners on the map; drag a small dot between two corners to add one. Keys: N and P select a corner, Shift with an arrow key moves it, Delete removes it." : ""));
  keyed(list, outlines.map((outline, i) => ({ outline, i, name: nameOutline(plan(), i), fault: wrong.outlines[i] })), (o) => o.i, makeOutline, refreshOutline);
  show(returnBox, returnPoint !== null);
  if (returnPoint) refreshReturnPoint(returnPoint, wrong.returnPoint);
  text(state, describeInForce(vehicle));
  const by = vehicle.map.placement;
  show(frame, Boolean(by));
  if (by) text(frame, `In metres of the world frame. Fixes have moved the map by ${metres(by.east_m)} east and ${metres(by.north_m)} north; outlines stay.`);
  show(editInForce, slotOf(vehicle, "fence")?.state === "refused" && Boolean(vehicle.fence_in_force));
}

function refreshReturnPoint(at, fault) {
  returnFields.update(at);
  show(returnFault, fault !== null);
  text(returnFault, fault ?? "");
}

/** The fence in force, as far as the surface knows. */
function describeInForce(vehicle) {
  const slot = slotOf(vehicle, "fence");
  const before = vehicle.fence_in_force;
  if (!slot || slot.state === "applied") {
    if (vehicle.in_force.fence === "none") return "The vehicle reports that no fence is in force.";
    if (vehicle.in_force.fence === "unknown") return "In force, unknown here: the vehicle has a fence that this surface has not sent. The surface asks for it.";
    if (!before) return "The vehicle has not reported yet whether a fence is in force.";
    if (vehicle.in_force.fence === "not_reported") return "In force by the last report, before a restart: the solid lines on the map.";
    return before.version === 0 ? "In force: the solid lines on the map, sent by another surface or before its files were lost." : "In force: the solid lines on the map.";
  }
  if (before && slot.state === "refused") return `Version ${before.version} stays in force (solid lines).`;
  return before ? `Version ${before.version} stays in force meanwhile (solid lines).` : "This surface does not know which fence is in force meanwhile.";
}
