// The dialog that explains the keys.

import { $, h } from "../dom.js";

const KEYS = [
  ["Arrows", "pan the map"], ["+ and \u2212", "zoom"], ["0", "show everything"], ["F", "follow the vehicle"],
  ["N, P", "constraints: next, previous corner; Shift with an arrow key moves it, Delete removes it"],
  ["Enter", "set a corner, a point to measure, the return point at the cross; Escape ends"],
  ["M", "measure"], ["Tab", "move to the next control"],
  ["Wheel, drag, pinch", "zoom and pan with mouse or fingers"],
];

export function startKeys() {
  $("keys-open").addEventListener("click", () => {
    const dialog = $("dialog");
    dialog.replaceChildren(
      h("h2", { id: "dialog-title" }, "Keys"),
      h("p", {}, "On the map, while it has the focus:"),
      h("dl.keys", {}, ...KEYS.map(([k, does]) => h("div", {}, h("dt", {}, k), h("dd", {}, does)))),
      h("div.buttons", {}, h("button.primary", { type: "button", onclick: () => dialog.close() }, "Close")),
    );
    dialog.showModal();
  });
}
