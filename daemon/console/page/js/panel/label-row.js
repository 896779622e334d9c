// The row of one label: colour, name, area, weight, exemplar.

import { h, show, text } from "../dom.js";
import { area, signed } from "../format.js";
import { nameOf, tintOf } from "../book.js";
import { layer } from "../map/layers.js";
import { store } from "../store.js";
import { exemplar, refreshExemplar } from "./exemplar.js";
import { editLabel } from "./label-dialog.js";
import { isMixed, weightsOrder } from "./weights.js";

const latest = new WeakMap();

export function makeRow(label) {
  const of = () => latest.get(node);
  const chip = h("button.chip", { type: "button", title: "Show only this label on the map; press again for all labels", onclick: () => highlight(label.id) });
  const name = h("button.name", { type: "button", onclick: () => editLabel(of()) });
  const size = h("span.area", { title: "Area on the map" });
  const gain = h("span.gain", { title: "Change of the area in the last five minutes; it shrinks where the vehicle gives cells another label" });
  const slider = h("input", { type: "range", min: -1, max: 1, step: 0.05, oninput: () => weightsOrder.set(store.vehicle, slider.valueAsNumber, label.id) });
  const value = h("output.value");
  const undo = h("button.undo", { type: "button", onclick: () => weightsOrder.undo(store.vehicle, label.id) }, "Undo");
  const note = h("p.note");
  const node = h("li.label", {}, chip,
    h("div.head", {}, name, gain, size),
    h("div.weight", { title: "How much the survey favours this label, -1 to 1" }, slider, value, undo),
    exemplar(of), note);
  node.parts = { chip, name, gain, size, slider, value, undo, note };
  latest.set(node, label);
  return node;
}

function highlight(id) {
  layer.highlight = layer.highlight === id ? null : id;
  store.emit("highlight");
}

export function refreshRow(node, label) {
  latest.set(node, label);
  const { parts } = node;
  const name = nameOf(label.id);
  const w = weightsOrder.value(store.vehicle, label.id);
  const isChanged = weightsOrder.isChanged(store.vehicle, label.id);
  const extra = label.members.length > 1 ? ` +${label.members.length - 1}` : "";
  parts.chip.style.backgroundColor = `rgb(${tintOf(label.id).join(" ")})`;
  parts.chip.setAttribute("aria-label", `Show only ${name} on the map`);
  parts.chip.setAttribute("aria-pressed", String(layer.highlight === label.id));
  text(parts.name, name + extra);
  parts.name.title = `${name}${extra && `, which stands for ${label.members.length - 1} more`}: name, colour, merge`;
  text(parts.size, area(label.area_m2));
  const gained = label.gained_m2 ?? 0;
  show(parts.gain, Math.abs(gained) >= 0.5);
  text(parts.gain, `${gained < 0 ? "\u2212" : "+"}${area(Math.abs(gained))}`);
  if (Number(parts.slider.value) !== w) parts.slider.value = w;
  parts.slider.setAttribute("aria-label", `Weight of ${name}`);
  parts.slider.setAttribute("aria-valuetext", signed(w));
  text(parts.value, signed(w));
  node.classList.toggle("moved", isChanged);
  show(parts.undo, isChanged);
  parts.undo.setAttribute("aria-label", `Undo the weight of ${name}`);
  const isConflicting = weightsOrder.isConflicting(store.vehicle, label.id);
  const mixed = isMixed(store.vehicle, label);
  show(parts.note, isConflicting || mixed);
  if (mixed) text(parts.note, "Its labels have different weights; a weight set here replaces them.");
  if (isConflicting) text(parts.note, `Another console set it to ${signed(label.weight)} meanwhile; Send replaces that.`);
  refreshExemplar(node.querySelector(".exemplar"), label, name);
}
