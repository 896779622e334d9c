// The fence in the panel: its outlines, their corners as numbers, their faults, sending.

import { dryRun } from "../api.js";
import { h, show, text } from "../dom.js";
import { begin, fenceOrder, finish, pen, pickTool, planOf, setReturnPoint } from "../fence/edit.js";
import { consequences, faults, fromServer, isSound, toOrder } from "../fence/plan.js";
import { count, metres, percent, span } from "../format.js";
import { inWorld } from "../map/frames.js";
import { orderFoot } from "../order/foot.js";
import { isVoid, slotOf } from "../order/status.js";
import { store } from "../store.js";
import { onMap, outlineList, place } from "./outline-list.js";

const list = outlineList(fenceOrder);
const hint = h("p.hint", { role: "status" });
const state = h("p.note");
const preview = h("p.note", { id: "fence-preview" });
const frame = h("p.note");
const tools = {
  fence: h("button", { type: "button", onclick: () => onMap(() => begin(fenceOrder, "fence")) }, "Draw fence"),
  keepOut: h("button", { type: "button", onclick: () => onMap(() => begin(fenceOrder, "keep_out")) }, "Add keep-out"),
  returnPoint: h("button", { type: "button", onclick: () => onMap(() => pickTool(fenceOrder, pen.tool === "return_point" ? null : "return_point")) }, "Place return point"),
  done: h("button.primary", { type: "button", onclick: finish }, "Done drawing"),
};
const editInForce = h("button.undo", { type: "button", onclick: () => fenceOrder.set(store.vehicle, fromServer(store.vehicle.fence_in_force.order)) }, "Edit the fence in force");
const returnFields = place("Return point", (p) => setReturnPoint(p));
const clearReturn = h("button.undo", { type: "button", onclick: () => setReturnPoint(null) }, "Remove");
clearReturn.setAttribute("aria-label", "Remove the return point");
const returnFault = h("p.error", { role: "alert" });
const returnBox = h("div.outline", {}, h("div.head", {}, h("b", {}, "Return point"), clearReturn), returnFields.node, returnFault);
const foot = orderFoot(fenceOrder, "Fence", "send-fence");

export const fencePart = h("section.part", { "aria-labelledby": "fence-title" },
  h("h3", { id: "fence-title" }, "Fence, keep-outs, return point"), state, editInForce, frame,
  h("div.buttons", {}, tools.fence, tools.keepOut, tools.returnPoint, tools.done), hint, list.node, returnBox, preview, foot.node);

const HINTS = {
  corner: "Click the map for each corner; click the first corner again, or Done, to close the outline. Keys: Enter sets a corner at the cross, Escape ends.",
  return_point: "Click the map at the point to which the vehicle should return. Keys: Enter sets it at the cross.",
};

export function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const plan = planOf(fenceOrder);
  const { outlines, returnPoint } = plan;
  const isDrawing = pen.order === fenceOrder && pen.tool === "corner";
  if (isDrawing && !outlines[pen.outline]) pickTool(fenceOrder, null);
  const sound = isSound(plan);
  foot.update(vehicle, !sound || isDrawing || wouldLiftUnknown(vehicle, plan));
  const found = sound && !isDrawing && fenceOrder.isChanged(vehicle) ? describePlan(vehicle, plan) : null;
  show(preview, found !== null);
  text(preview, found === null ? askForPass(null) : found + askForPass(vehicle, plan));
  text(tools.fence, outlines[0]?.kind === "fence" ? "Extend fence" : "Draw fence");
  tools.returnPoint.setAttribute("aria-pressed", String(pen.tool === "return_point"));
  for (const [name, node] of Object.entries(tools)) show(node, (name === "done") === isDrawing);
  text(hint, (pen.order === fenceOrder && HINTS[pen.tool]) || (outlines.length > 0 ? "Drag corners on the map; drag a small dot between two corners to add one. Keys: N and P select a corner, Shift with an arrow key moves it, Delete removes it." : ""));
  list.update();
  show(returnBox, returnPoint !== null);
  if (returnPoint) refreshReturnPoint(returnPoint, faults(plan).returnPoint);
  const reason = wouldLiftUnknown(vehicle, plan) ? " Without a fence, this plan would lift the one in force: draw a fence, or wait for the report." : "";
  text(state, describeInForce(vehicle) + reason);
  const by = vehicle.map.placement;
  show(frame, Boolean(by));
  if (by) text(frame, `In metres of the world frame. Fixes have moved the map by ${metres(by.east_m)} east and ${metres(by.north_m)} north; outlines stay.`);
  show(editInForce, isVoid(slotOf(vehicle, "fence")) && Boolean(vehicle.fence_in_force));
}

/** What the plan would mean for the vehicle, before it is sent. */
function describePlan(vehicle, plan) {
  const s = vehicle.status;
  const cells = cellsOf(vehicle);
  const found = consequences(plan, cells, s && inWorld(vehicle, s.x_m, s.y_m));
  if (!found) return fenceOrder.read(vehicle).outlines.some((o) => o.kind === "fence") ? "Without a fence: the order removes the one that was sent." : null;
  const cut = cells.length === 0 ? "" : ` ${count(found.cut)} of ${count(cells.length)} explored cells lie outside (${percent(found.cut / cells.length)}).`;
  const where = found.distance === null ? "" : found.isInside
    ? ` By its last report ${vehicle.name} is inside, ${metres(found.distance)} from the nearest edge.`
    : ` By its last report ${vehicle.name} is where it must not be, ${metres(found.distance)} from the nearest edge: it will refuse this order.`;
  return `Area ${count(found.area)} m\u00b2.${cut}${where}`;
}

/** How long a survey in straight legs takes within a plan, once the surface has told it; asked for when the plan rests. */
const pass = { key: null, told: "", timer: 0 };
const REST_MS = 400;

function askForPass(vehicle, plan) {
  const key = vehicle && JSON.stringify([vehicle.id, toOrder(plan)]);
  if (key === pass.key) return pass.told;
  clearTimeout(pass.timer);
  Object.assign(pass, { key, told: "" });
  if (key !== null) pass.timer = setTimeout(() => tellPass(key, vehicle.id, toOrder(plan)), REST_MS);
  return "";
}

async function tellPass(key, id, fence) {
  // The order itself is refused with the reason.
  const found = await dryRun(id, { fence }).catch(() => null);
  if (pass.key !== key || !found) return;
  pass.told = found.pass
    ? ` One pass in straight legs within it takes about ${span(found.pass.time_s)}, ${metres(found.pass.metres, 0)}.`
    : " It leaves no straight legs of the survey.";
  store.emit("edit");
}

/** The centres of the explored cells in the world, for the version of the map that was looked at last. */
let cellsKept = { key: "", cells: [] };

function cellsOf(vehicle) {
  const { map } = store;
  const key = `${vehicle.id} ${map?.tag} ${JSON.stringify(vehicle.map.placement)}`;
  if (cellsKept.key !== key) {
    const centre = ({ x, y }) => inWorld(vehicle, (x + 0.5) * map.cell_m, (y + 0.5) * map.cell_m);
    cellsKept = { key, cells: map ? [...map.cells()].map(centre) : [] };
  }
  return cellsKept.cells;
}

function refreshReturnPoint(at, fault) {
  returnFields.update(at);
  show(returnFault, fault !== null);
  text(returnFault, fault ?? "");
}

/** Whether the plan, sent as a whole, would lift a fence that the vehicle may have and this surface does not know. */
function wouldLiftUnknown(vehicle, { outlines, returnPoint }) {
  const isKnown = vehicle.fence_in_force || slotOf(vehicle, "fence") || vehicle.in_force.fence === "none";
  return !isKnown && outlines[0]?.kind !== "fence" && (outlines.length > 0 || returnPoint !== null);
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
  if (before && isVoid(slot)) return `Version ${before.version} stays in force (solid lines).`;
  return before ? `Version ${before.version} stays in force meanwhile (solid lines).` : "This surface does not know which fence is in force meanwhile.";
}
