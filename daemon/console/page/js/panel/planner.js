// Who chooses the way on the vehicle: parallel legs, the best place nearby, or a look some steps ahead.

import { sendPlanner } from "../api.js";
import { h, show, text } from "../dom.js";
import { store } from "../store.js";
import { describe, slotOf } from "./lifeline.js";
import { Order } from "./order.js";
import { othersNote } from "./ours.js";

const CHOICES = [
  ["", "as configured there"], ["lawnmower", "lawnmower: parallel legs"],
  ["greedy", "greedy: best nearby"], ["horizon", "horizon: looks ahead"],
];
export const order = new Order("settings", (v) => v.planner ?? "", (v, planner) => sendPlanner(v.id, planner));
const pick = h("select", { id: "planner", onchange: () => order.set(store.vehicle, pick.value) }, ...CHOICES.map(([value, name]) => h("option", { value }, name)));
const set = h("button", { type: "button", id: "send-planner", onclick: () => order.send(store.vehicle) }, "Set");
set.setAttribute("aria-label", "Set the planner");
const error = h("p.error", { role: "alert" });
const note = h("p.note");
const others = othersNote(order.ours, "Planner");

export const plannerPart = h("div.planner", {}, h("label", { for: "planner" }, "Planner"), pick, set, note, error, others.node);

export function refreshPlanner(vehicle) {
  const { busy, error: problem, waiting } = order.settle(vehicle);
  const slot = slotOf(vehicle, "settings");
  const again = slot?.state === "refused" && !order.changed(vehicle);
  pick.value = order.value(vehicle);
  set.disabled = busy || !store.connected || (!order.changed(vehicle) && !again);
  text(error, problem ?? "");
  show(note, slot !== null || waiting !== null);
  note.dataset.state = slot?.state ?? "none";
  text(note, waiting ?? describe(slot));
  others.update(vehicle, order.changedElsewhere(vehicle) ? `Set to ${vehicle.planner ?? "as configured"} by another console meanwhile; Set replaces it.` : null);
}
