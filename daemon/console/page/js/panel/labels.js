// The list of labels with their weights, and the order that sends the weights.

import { $, h, keyed, show, text } from "../dom.js";
import { shownLabels } from "../book.js";
import { lockInRecord, principal } from "../command.js";
import { ago } from "../format.js";
import { orderFoot } from "../order/foot.js";
import { recall, remember } from "../prefs.js";
import { ageOf, isStale, store } from "../store.js";
import { cutPart, refreshCut } from "./label-cut.js";
import { makeRow, refreshRow } from "./label-row.js";
import { plannerPart, refreshPlanner } from "./planner.js";
import { refreshTry, tryButton, tryPart } from "./try.js";
import { TERMS, weightsDraft, weightsOrder } from "./weights.js";

const weight = (label) => weightsOrder.value(store.vehicle, label.id);
const SORTINGS = {
  id: (a, b) => a.id - b.id,
  area: (a, b) => b.area_m2 - a.area_m2 || a.id - b.id,
  weight: (a, b) => weight(b) - weight(a) || a.id - b.id,
};
const TERM_TEXTS = {
  exploration: ["Unexplored", "Weight of unexplored cells, compared with the weights of labels"],
  curiosity: ["Curiosity", "Weight of cells that the scene model explains badly (perplexity)"],
};
const EMPTY = { map: "No labels yet. They appear with the first cells of the map.", difference: "The two maps are the same at this moment." };
const empty = h("p.empty", {}, EMPTY.map);
const terms = TERMS.map(termRow);
const caption = (unsent) => (unsent === 0 ? "Send weights" : `Send ${unsent} change${unsent === 1 ? "" : "s"}`);
const foot = orderFoot(weightsOrder, "Weights", "send-weights", caption);
const draftNote = h("p.note");
let shownVehicle = null;

function termRow(term) {
  const [caption, hint] = TERM_TEXTS[term];
  const slider = h("input", { type: "range", min: -1, max: 1, step: 0.05, id: term, oninput: () => weightsOrder.set(store.vehicle, slider.valueAsNumber, term) });
  const value = h("output.value", { for: term });
  const node = h("div.exploration", { data: { term }, title: hint }, h("label", { for: term }, caption), slider, value);
  const update = (vehicle) => {
    const w = weightsOrder.value(vehicle, term);
    if (slider.valueAsNumber !== w) slider.value = w;
    text(value, w.toFixed(2));
    node.classList.toggle("moved", weightsOrder.isChanged(vehicle, term));
  };
  return { node, update };
}

export function startLabels() {
  const sorting = $("label-order");
  sorting.value = recall("label-order", "id");
  sorting.addEventListener("change", () => {
    remember("label-order", sorting.value);
    update();
  });
  $("label-list").before(plannerPart, ...terms.map((t) => t.node), cutPart, empty);
  foot.node.firstElementChild.append(tryButton);
  $("send").append(draftNote, tryPart, foot.node);
  weightsDraft.start();
  store.on("state select edit book highlight feed theme", update);
  store.on("tick", refreshOrders);
}

function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  if (shownVehicle !== vehicle.id) $("label-list").replaceChildren();
  shownVehicle = vehicle.id;
  refreshOrders();
  refreshCut(vehicle);
  const rows = shownLabels(vehicle).sort(SORTINGS[$("label-order").value] ?? SORTINGS.id);
  keyed($("label-list"), rows, (l) => l.id, makeRow, refreshRow);
  show(empty, rows.length === 0);
  text(empty, store.replay?.side === "difference" ? EMPTY.difference : EMPTY.map);
  $("labels").classList.toggle("stale", isStale(vehicle));
  for (const t of terms) t.update(vehicle);
  for (const part of document.querySelectorAll("#labels :is(.label .weight, .exploration)")) lockInRecord(part);
}

function refreshOrders() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  refreshPlanner(vehicle);
  const { author, at_s } = vehicle.draft;
  const isOfOther = weightsOrder.isChanged(vehicle) && author !== "" && author !== principal()?.name;
  show(draftNote, isOfOther);
  text(draftNote, isOfOther ? `Set by ${author} ${ago(ageOf(at_s))}, not sent yet.` : "");
  foot.update(vehicle, vehicle.labels.length === 0);
  refreshTry(vehicle);
}
