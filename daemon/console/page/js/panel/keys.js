// The dialog that explains the keys.

import { $, h } from "../dom.js";
import { store } from "../store.js";

const ANYWHERE = [["Shift+H", "hold the vehicle, or resume; asks first"], ["Shift+A", "abort the mission; asks first"]];
const KEYS = [
  ["Arrows", "pan the map"], ["+ and \u2212", "zoom"], ["0", "show everything"], ["F", "follow the vehicle"],
  ["N, P", "constraints: next, previous corner; Shift with an arrow key moves it, Delete removes it"],
  ["Enter", "choose the place at the cross, or set a corner, a point to measure, the return point; Escape ends"],
  ["M", "measure"], ["L", "the colours of the labels, or of their images"], ["T", "in a rehearsal: the true sea floor, or the map again"], ["Tab", "move to the next control"],
  ["Wheel, drag, pinch", "zoom and pan with mouse or fingers"],
];

const REPLAY = [["Space", "play or pause"], ["\u2190 and \u2192", "10 seconds back, forward"], ["Shift with \u2190 or \u2192", "the event before, the next event"]];

const list = (keys) => h("dl.keys", {}, ...keys.map(([key, does]) => h("div", {}, h("dt", {}, key), h("dd", {}, does))));

export function startKeys() {
  $("keys-open").addEventListener("click", () => {
    const dialog = $("dialog");
    dialog.replaceChildren(
      h("h2", { id: "dialog-title" }, "Keys"),
      ...(store.replay ? [h("p", {}, "Record, except where a key has another use:"), list(REPLAY)] : [h("p", {}, "Everywhere, except while you type:"), list(ANYWHERE)]),
      h("p", {}, "On the map, while it has the focus:"),
      list(KEYS),
      h("div.buttons", {}, h("button.primary", { type: "button", onclick: () => dialog.close() }, "Close")),
    );
    dialog.showModal();
  });
}
