// Weighted areas in the panel: places that matter whatever lies there.

import { h, show, text } from "../dom.js";
import { areasOrder, begin, finish, pen, pickTool, planOf } from "../fence/edit.js";
import { isSound } from "../fence/plan.js";
import { orderFoot } from "../order/foot.js";
import { slotOf } from "../order/status.js";
import { store } from "../store.js";
import { onMap, outlineList } from "./outline-list.js";

const MAX_AREAS = 4;
const list = outlineList(areasOrder);
const hint = h("p.hint", { role: "status" });
const state = h("p.note");
const draw = h("button", { type: "button", onclick: () => onMap(() => begin(areasOrder, "area")) }, "Draw area");
const done = h("button.primary", { type: "button", onclick: finish }, "Done drawing");
const foot = orderFoot(areasOrder, "Areas", "send-areas");

export const areasPart = h("section.part", { "aria-labelledby": "areas-title" },
  h("h3", { id: "areas-title" }, "Weighted areas"),
  h("p.hint", {}, "The weight of an area is added to the weights of the labels inside: the vehicle prefers it, or avoids it if the weight is negative."),
  state, h("div.buttons", {}, draw, done), hint, list.node, foot.node);

const HINT = "Click the map for each corner; click the first corner again, or Done, to close the area. Keys: Enter sets a corner at the cross, Escape ends.";

export function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const plan = planOf(areasOrder);
  const isDrawing = pen.order === areasOrder && pen.tool === "corner";
  if (isDrawing && !plan.outlines[pen.outline]) pickTool(areasOrder, null);
  foot.update(vehicle, !isSound(plan));
  show(draw, !isDrawing);
  show(done, isDrawing);
  draw.disabled = plan.outlines.length >= MAX_AREAS;
  draw.title = draw.disabled ? `There are at most ${MAX_AREAS} areas` : "";
  text(hint, isDrawing ? HINT : "");
  list.update();
  text(state, describeInForce(vehicle));
}

/** The areas in force, as far as the surface knows. */
function describeInForce(vehicle) {
  const slot = slotOf(vehicle, "areas");
  const before = vehicle.areas_in_force;
  if (!slot || slot.state === "applied") {
    if (vehicle.in_force.areas === "none") return "The vehicle reports that no area has a weight.";
    if (vehicle.in_force.areas === "unknown") return "In force, unknown here: the vehicle has areas that this surface has not sent. The surface asks for them.";
    if (!before) return "The vehicle has not reported yet whether an area has a weight.";
    if (vehicle.in_force.areas === "not_reported") return "In force by the last report, before a restart: the solid lines on the map.";
    return before.version === 0 ? "In force: the solid lines on the map, sent by another surface or before its files were lost." : "In force: the solid lines on the map.";
  }
  return before ? `Version ${before.version} stays in force meanwhile (solid lines).` : "This surface does not know which areas are in force meanwhile.";
}
