// The choice of the planner on the vehicle.

import { sendPlanner } from "../api.js";
import { denial } from "../command.js";
import { h, show, text } from "../dom.js";
import { Order } from "../order/order.js";
import { replacedNote } from "../order/sent-versions.js";
import { describe, slotOf } from "../order/status.js";
import { store } from "../store.js";

const CHOICES = [
  ["", "as configured"], ["lawnmower", "lawnmower: parallel legs"],
  ["greedy", "greedy: best nearby"], ["horizon", "horizon: plans ahead"],
];
export const order = new Order("settings", (v) => v.planner ?? "", (v, value) => sendPlanner(v.id, value()));
const pick = h("select", { id: "planner", onchange: () => order.set(store.vehicle, pick.value) }, ...CHOICES.map(([value, name]) => h("option", { value }, name)));
const set = h("button", { type: "button", id: "send-planner", onclick: () => order.send(store.vehicle) }, "Set");
set.setAttribute("aria-label", "Set the planner");
const errorLine = h("p.error", { role: "alert" });
const note = h("p.note");
const replaced = replacedNote(order.sentVersions, "Planner");

export const plannerPart = h("div.planner", {}, h("label", { for: "planner" }, "Planner"), pick, set, note, errorLine, replaced.node);

export function refreshPlanner(vehicle) {
  const { busy, error, waiting } = order.progress(vehicle);
  const slot = slotOf(vehicle, "settings");
  const again = slot?.state === "refused" && !order.isChanged(vehicle);
  pick.value = order.value(vehicle);
  const denied = denial("settings");
  pick.disabled = denied !== null;
  pick.title = denied ?? "";
  set.title = denied ?? "";
  set.disabled = busy || denied !== null || !store.connected || (!order.isChanged(vehicle) && !again);
  text(errorLine, error ?? "");
  show(note, slot !== null || waiting !== null);
  note.dataset.state = slot?.state ?? "none";
  text(note, waiting ?? describe(slot));
  replaced.update(vehicle, order.hasConflict(vehicle) ? `Another console chose ${vehicle.planner ?? "the configured planner"} meanwhile; Set replaces its choice.` : null);
}
