// One label: colour, name, area, weight, picture.

import { h, show, text } from "../dom.js";
import { area, signed } from "../format.js";
import { nameOf, tintOf } from "../book.js";
import { layer } from "../map/layers.js";
import { store } from "../store.js";
import { changedElsewhere, draft, setWeight, weight } from "./draft.js";
import { exemplar, refreshExemplar } from "./exemplar.js";
import { editLabel } from "./label-dialog.js";

const latest = new WeakMap();

export function makeRow(label) {
  const of = () => latest.get(node);
  const chip = h("button.chip", { type: "button", onclick: () => highlight(label.id) });
  const name = h("button.name", { type: "button", title: "Name, colour, merge", onclick: () => editLabel(of()) });
  const size = h("span.area");
  const slider = h("input", { type: "range", min: -1, max: 1, step: 0.05, oninput: () => setWeight(of(), Number(slider.value)) });
  const value = h("output.value");
  const undo = h("button.undo", { type: "button", onclick: () => setWeight(of(), draft().weights.get(label.id).base) }, "Undo");
  const note = h("p.note");
  const node = h("li.label", {}, chip,
    h("div.head", {}, name, size),
    h("div.weight", {}, slider, value, undo),
    exemplar(of), note);
  node.parts = { chip, name, size, slider, value, undo, note };
  latest.set(node, label);
  return node;
}

function highlight(id) {
  layer.highlight = layer.highlight === id ? null : id;
  store.tell("highlight");
}

export function refreshRow(node, label) {
  latest.set(node, label);
  const { parts } = node;
  const name = nameOf(label.id);
  const w = weight(label);
  const mine = draft().weights.get(label.id);
  const extra = label.members.length > 1 ? ` +${label.members.length - 1}` : "";
  parts.chip.style.backgroundColor = `rgb(${tintOf(label.id).join(" ")})`;
  parts.chip.setAttribute("aria-label", `Show only ${name} on the map`);
  parts.chip.setAttribute("aria-pressed", String(layer.highlight === label.id));
  text(parts.name, name + extra);
  text(parts.size, area(label.area_m2));
  if (Number(parts.slider.value) !== w) parts.slider.value = w;
  parts.slider.setAttribute("aria-label", `Weight of ${name}`);
  parts.slider.setAttribute("aria-valuetext", signed(w));
  text(parts.value, signed(w));
  node.classList.toggle("moved", Boolean(mine && !mine.sent));
  show(parts.undo, Boolean(mine && !mine.sent));
  parts.undo.setAttribute("aria-label", `Undo the weight of ${name}`);
  const other = changedElsewhere(label);
  show(parts.note, other !== null);
  if (other !== null) text(parts.note, `Set to ${signed(other)} elsewhere meanwhile; sending replaces it.`);
  refreshExemplar(node.querySelector(".exemplar"), label, name);
}
