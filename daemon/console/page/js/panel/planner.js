// The choice of the planner on the vehicle, and of the end of an adaptive survey.

import { sendSettings } from "../api.js";
import { denial } from "../command.js";
import { h, show, text } from "../dom.js";
import { Order } from "../order/order.js";
import { replacedNote } from "../order/sent-versions.js";
import { describe, isVoid, slotOf } from "../order/status.js";
import { store } from "../store.js";

const DEFAULT = ["", "vehicle's default"];
const LINES = [
  {
    key: "planner", name: "Planner", hint: "Planner of the vehicle's path once it has a utility",
    choices: [DEFAULT, ["lawnmower", "lawnmower: parallel legs"], ["greedy", "greedy: best nearby"], ["horizon", "horizon: plans ahead"]],
    read: (v) => v.planner ?? "",
  },
  {
    key: "at_end", name: "At the end", hint: "What the vehicle does once no look at a weighed label pays any more. It holds where a repeated round would be a turn on the spot",
    choices: [DEFAULT, ["repeat", "repeat: explore, then look again"], ["explore", "explore, then hold"], ["hold", "hold"]],
    read: (v) => v.settings?.requested.at_end ?? "",
  },
];
const KEYS = LINES.map((line) => line.key);

/** The settings to send: those that are edited, or both where a refused order is sent again. */
function settings(vehicle, value) {
  const edited = KEYS.filter((key) => order.isChanged(vehicle, key));
  return Object.fromEntries((edited.length > 0 ? edited : KEYS).map((key) => [key, value(key)]));
}

export const order = new Order("settings", (v, part) => LINES.find((line) => line.key === part).read(v), (v, value) => sendSettings(v.id, settings(v, value)));
const rows = LINES.map(({ key, name, hint, choices }) => {
  const pick = h("select", { id: key.replace("_", "-"), onchange: () => order.set(store.vehicle, pick.value, key) }, ...choices.map(([value, words]) => h("option", { value }, words)));
  return { key, hint, pick, label: h("label", { for: pick.id, title: hint }, name) };
});
const set = h("button", { type: "button", id: "send-planner", onclick: () => order.send(store.vehicle) }, "Set");
set.setAttribute("aria-label", "Set the planner");
const errorLine = h("p.error", { role: "alert" });
const note = h("p.note");
const replaced = replacedNote(order.sentVersions, "Planner");

const [planner, atEnd] = rows;
export const plannerPart = h("div.planner", {}, planner.label, planner.pick, set, atEnd.label, atEnd.pick, note, errorLine, replaced.node);

export function refreshPlanner(vehicle) {
  const { busy, error, waiting } = order.progress(vehicle);
  const slot = slotOf(vehicle, "settings");
  const again = isVoid(slot) && !order.isChanged(vehicle);
  const denied = denial("settings");
  for (const { key, hint, pick } of rows) {
    pick.value = order.value(vehicle, key);
    pick.disabled = denied !== null;
    pick.title = denied ?? hint;
  }
  set.title = denied ?? "";
  set.disabled = busy || denied !== null || !store.connected || (!order.isChanged(vehicle) && !again);
  text(errorLine, error ?? "");
  show(note, slot !== null || waiting !== null);
  note.dataset.state = slot?.state ?? "none";
  text(note, waiting ?? describe(slot));
  replaced.update(vehicle, order.hasConflict(vehicle) ? "Another console chose another planner or end meanwhile; Set replaces its choice." : null);
}
