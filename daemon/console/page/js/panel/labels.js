// The list of labels with weights, and the button that sends them.

import { $, h, keyed, show, text } from "../dom.js";
import { shownLabels } from "../book.js";
import { recall, remember } from "../prefs.js";
import { isStale, store } from "../store.js";
import { discard, draft, ours, send, serverTerm, setTerm, settle, term, termsChangedElsewhere, unsent, weight } from "./draft.js";
import { makeRow, refreshRow } from "./label-row.js";
import { lifeline, slotOf } from "./lifeline.js";
import { othersNote } from "./ours.js";
import { plannerPart, refreshPlanner } from "./planner.js";

const ORDERS = {
  id: (a, b) => a.id - b.id,
  area: (a, b) => b.area_m2 - a.area_m2 || a.id - b.id,
  weight: (a, b) => weight(b) - weight(a) || a.id - b.id,
};
const line = lifeline("Weights");
const empty = h("p.empty", {}, "No labels yet. They appear with the first cells of the map.");
const terms = [
  termRow("exploration", "Unexplored", "Weight of unexplored ground against known labels"),
  termRow("curiosity", "Curiosity", "Weight of ground that the scene model explains badly (perplexity)"),
];
const others = othersNote(ours, "Weights");
const go = h("button.primary", { type: "button", id: "send-weights", onclick: () => send(store.vehicle, labels()) }, "Send weights");
const drop = h("button", { type: "button", onclick: discard }, "Discard");
const error = h("p.error", { role: "alert" });
const labels = () => (store.vehicle ? shownLabels(store.vehicle) : []);
let shownVehicle = null;

function termRow(name, words, hint) {
  const slider = h("input", { type: "range", min: -1, max: 1, step: 0.05, id: name, oninput: () => setTerm(store.vehicle, name, slider.valueAsNumber) });
  const value = h("output.value", { for: name });
  const node = h("div.exploration", { data: { term: name } }, h("label", { for: name, title: hint }, words), slider, value);
  const update = (vehicle) => {
    const w = term(vehicle, name);
    const known = serverTerm(vehicle, name) !== null || draft().terms.has(name);
    if (slider.valueAsNumber !== w) slider.value = w;
    text(value, w.toFixed(2));
    value.title = known ? "" : "The daemon does not report this value; this is the default.";
    node.classList.toggle("moved", draft().terms.has(name));
  };
  return { node, update };
}

export function startLabels() {
  const order = $("label-order");
  order.value = recall("label-order", "id");
  order.addEventListener("change", () => {
    remember("label-order", order.value);
    update();
  });
  $("label-list").before(plannerPart, ...terms.map((t) => t.node), empty);
  $("send").append(h("div.buttons", {}, go, drop), error, others.node, line.node);
  store.on("state select draft book highlight feed theme", update);
  store.on("tick", refreshLine);
}

function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  if (shownVehicle !== vehicle.id) $("label-list").replaceChildren();
  shownVehicle = vehicle.id;
  settle(vehicle);
  const rows = labels().sort(ORDERS[$("label-order").value] ?? ORDERS.id);
  keyed($("label-list"), rows, (l) => l.id, makeRow, refreshRow);
  show(empty, rows.length === 0);
  $("labels").classList.toggle("stale", isStale(vehicle));
  for (const t of terms) t.update(vehicle);
  refreshLine();
}

function refreshLine() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const d = draft();
  const slot = slotOf(vehicle, "utility");
  refreshPlanner(vehicle);
  others.update(vehicle, termsChangedElsewhere(vehicle) ? "Exploration or curiosity was changed by another console meanwhile; sending replaces it, Discard takes it over." : null);
  const n = unsent();
  const again = slot?.state === "refused";
  go.disabled = d.busy || !store.connected || labels().length === 0 || (n === 0 && !again);
  text(go, n > 0 ? `Send ${n} change${n === 1 ? "" : "s"}` : again ? "Send again" : "Send weights");
  show(drop, n > 0);
  show(error, d.error !== null);
  text(error, d.error ?? "");
  const handing = d.busy ? "Handing over to scenecast." : null;
  const taken = d.sentVersion !== null && (slot?.version ?? 0) < d.sentVersion ? `Version ${d.sentVersion} handed over; no report yet.` : null;
  line.update(slot, handing ?? taken);
}
