// The slider that chooses how many labels the map tells apart: a cut of the vehicle's tree.

import { cut, finestCut, setCut } from "../book.js";
import { h, show, text } from "../dom.js";
import { store } from "../store.js";

const choose = (count) => setCut(count >= finestCut(store.vehicle) ? null : count);
const slider = h("input", { type: "range", id: "label-cut", min: 2, step: 1, oninput: () => choose(slider.valueAsNumber) });
const value = h("output.value", { for: "label-cut" });
const hint = h("button.link", { type: "button", title: "The number of labels at which the labels differ most clearly from each other", onclick: () => choose(store.vehicle.label_tree.clearest) });

/** Labels that look alike become one when there are fewer; each group keeps the colour and the name of one of them. */
export const cutPart = h("div.cut", { title: "How many labels the map tells apart. Those that look most alike become one." },
  h("label", { for: "label-cut" }, "Labels shown"), slider, value, hint);

export function refreshCut(vehicle) {
  const finest = finestCut(vehicle);
  show(cutPart, finest > 2);
  if (finest <= 2) return;
  const shown = cut(vehicle);
  slider.max = finest;
  if (slider.valueAsNumber !== shown) slider.value = shown;
  slider.setAttribute("aria-valuetext", `${shown} of ${finest} labels`);
  text(value, `${shown} of ${finest}`);
  const clearest = vehicle.label_tree.clearest;
  show(hint, clearest !== null && clearest !== shown);
  text(hint, clearest === null ? "" : `clearest: ${clearest}`);
}
