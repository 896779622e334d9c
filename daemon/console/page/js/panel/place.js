// The plate of the chosen place: its label with images and ages, the labels that it had before, its marker, and the buttons that set one and send the
// vehicle there.

import { addMarker, removeMarker, sendDestination } from "../api.js";
import { nameOf, shownAs, tintOf } from "../book.js";
import { denial } from "../command.js";
import { $, announce, fill, h, text } from "../dom.js";
import { ago, metres, span } from "../format.js";
import { view } from "../map/chart.js";
import { chosen, chosenMarker, clearPlace, isDestination } from "../map/place.js";
import { isSamePlace } from "../map/destination.js";
import { onMap } from "../map/frames.js";
import { cellAt, layerText } from "../map/readout.js";
import { orderStatus, slotOf } from "../order/status.js";
import { ageOf, store } from "../store.js";
import { viewExemplars } from "./exemplar.js";
import { historyLines } from "./place-history.js";

const MAX_IMAGES = 4;
const title = h("h2", { id: "place-title" });
const facts = h("div");
const images = h("div.place-images");
const marked = h("div");
const words = h("input", { type: "text", maxLength: 200, required: true, placeholder: "a wreck", "aria-label": "Text of the marker" });
const set = h("button.primary", { type: "submit" }, "Set marker");
const form = h("form", { onsubmit: mark }, words, set);
const go = h("button", { type: "button", onclick: () => order(chosen.at) }, "Go there");
const status = orderStatus("Destination");
const withdraw = h("button", { type: "button", onclick: () => order(null) }, "Withdraw the destination");
const error = h("p.error", { role: "alert" });
const plate = h("section.plate", { id: "place", hidden: true, "aria-labelledby": "place-title" },
  h("header", {}, title, h("button.quiet", { type: "button", onclick: clearPlace, "aria-label": "Close the place" }, "\u00d7")),
  facts, images, h("div.buttons", {}, go, withdraw), status.node, marked, form, error);

export function startPlace() {
  $("stage").append(plate);
  plate.addEventListener("keydown", (event) => event.key === "Escape" && clearPlace());
  store.on("place", () => {
    text(error, "");
    words.value = "";
    keepOffPlace();
    refresh();
    const label = labelHere();
    if (label !== null) showRow(label);
  });
  store.on("state map book tick", refresh);
}

/** Moves the plate to the half of the map in which the chosen place is not, since it would cover the place. */
function keepOffPlace() {
  if (chosen.at === null) return;
  const [px] = view.toScreen(...chosen.at);
  plate.classList.toggle("at-left", px > view.width / 2);
}

/** The cell at the chosen place, or null. */
const cellHere = () => (store.map && chosen.at ? cellAt(store.map, ...onMap(store.vehicle, ...chosen.at)) : null);

function labelHere() {
  const cell = cellHere();
  return cell && shownAs(cell.label);
}

/** Brings the row of a label into view and marks it. */
function showRow(label) {
  for (const row of document.querySelectorAll("#label-list > .here")) row.classList.remove("here");
  const row = document.querySelector(`#label-list > .label[data-key='${label}']`);
  row?.classList.add("here");
  row?.scrollIntoView({ block: "nearest" });
}

function refresh() {
  plate.hidden = chosen.at === null || !store.vehicle;
  if (plate.hidden) {
    for (const row of document.querySelectorAll("#label-list > .here")) row.classList.remove("here");
    return;
  }
  const cell = cellHere();
  const marker = chosenMarker();
  const label = cell && store.vehicle.labels.find((l) => l.id === shownAs(cell.label));
  text(title, `E ${metres(chosen.at[0])}  N ${metres(chosen.at[1])}`);
  const denied = denial("record");
  set.disabled = denied !== null || !store.connected;
  set.title = denied ?? "";
  form.hidden = marker !== null;
  const refusal = denial("order");
  for (const button of [go, withdraw]) {
    button.disabled = refusal !== null || !store.connected;
    button.title = refusal ?? (button === go ? "The vehicle goes there at once, then it resumes its survey" : "");
  }
  go.hidden = isDestination();
  withdraw.hidden = !isDestination();
  status.node.hidden = !isSamePlace(store.vehicle.destination?.place, chosen.at);
  status.update(slotOf(store.vehicle, "destination"));
  fill(facts, label && labelLine(label), ...linesOf(cell, marker).map((line) => h("p", {}, line)));
  const pictures = label?.exemplar.images.slice(-MAX_IMAGES).reverse() ?? [];
  // Buttons are replaced only when they change: one of them may have the focus.
  renew(images, [label && nameOf(label.id), pictures.map((i) => [i.url, i.at_s])], () => pictures.map((i) => picture(label, i)));
  renew(marked, [marker, denied], () => (marker ? [markerPart(marker, denied)] : []));
}

/** The lines of text about the place. */
function linesOf(cell, marker) {
  const age = cell?.ageS === null ? "at an unknown time" : `${span(cell?.ageS)} ago`;
  const before = historyLines(cell, refresh);
  const lines = cell ? [`received ${age}`, ...before, ...cell.layers.map((l) => `${l.name} ${layerText(l)}`)] : ["unexplored"];
  return marker ? [...lines, `marked by ${marker.author}, ${ago(ageOf(marker.at_s))}`] : lines;
}

function renew(node, facts, make) {
  const key = JSON.stringify(facts);
  if (node.dataset.key === key) return;
  node.dataset.key = key;
  fill(node, ...make());
}

function labelLine(label) {
  const square = h("i.truth-chip", { "aria-hidden": "true" });
  square.style.background = `rgb(${tintOf(label.id).join(" ")})`;
  return h("p", {}, square, " ", h("b", {}, nameOf(label.id)));
}

const picture = (label, image) =>
  h("button.image", { type: "button", "aria-label": `Images of ${nameOf(label.id)}`, onclick: () => viewExemplars(label) },
    h("img", { alt: "", width: 44, height: 44, src: `${image.url}?at=${image.at_s}` }));

function markerPart(marker, denied) {
  const remove = h("button", { type: "button", disabled: denied !== null, onclick: () => take(marker) }, "Remove marker");
  return h("div", {}, h("p", {}, h("b", {}, marker.text)), remove);
}

async function mark(event) {
  event.preventDefault();
  const [x, y] = chosen.at;
  await send(() => addMarker(store.vehicle.id, x, y, words.value.trim()), `marker set: ${words.value.trim()}`);
}

/** Sends the vehicle to a place, or withdraws the order. The plate stays open and shows how far the order has come. */
async function order(place) {
  try {
    await sendDestination(store.vehicle.id, place);
    announce(place ? `destination sent: E ${metres(place[0])} N ${metres(place[1])}` : "the order to withdraw the destination is sent");
  } catch (fault) {
    text(error, fault.message);
  }
}

const take = (marker) => send(() => removeMarker(store.vehicle.id, marker.number), `marker removed: ${marker.text}`);

/** Sends a change; the next state of the surface shows it. */
async function send(change, message) {
  try {
    await change();
    announce(message);
    clearPlace();
  } catch (fault) {
    text(error, fault.message);
  }
}
