// The background streams that use spare capacity, in an order that the operator changes.

import { h, show, text } from "../dom.js";
import { plain } from "../format.js";
import { store } from "../store.js";

const NAMES = { finer: "finer cells, while the map is coarse", exemplars: "images of new labels", floor: "images of the sea floor" };
const HELP = { finer: "Cells between the coarse ones", exemplars: "Images that nobody has requested, one for each new label", floor: "The sea floor itself, all of it coarse first, then fine" };
const nameOf = (stream) => NAMES[stream] ?? `layer ${plain(stream)}`;
const helpOf = (stream) => `${HELP[stream] ?? "Values of this layer of the map"}, sent while nothing else waits`;
/** Every stream: three of the page, and the layers that the surface lists. */
const streams = () => [...Object.keys(NAMES), ...(store.snapshot?.layers.map((l) => l.name) ?? [])];

/** `value()` returns the streams in order, `change(streams)` sets them. */
export function backgroundBox(value, change) {
  const list = h("ol", {});
  const none = h("p.note", {}, "No stream: spare capacity is not used.");
  const node = h("div.background", { role: "group", "aria-label": "Use of spare capacity" },
    h("h3", {}, "Order of use of spare capacity"), list, none);
  return { node, refresh };

  function refresh(order) {
    show(none, order.length === 0);
    const key = [...order, "", ...streams()].join();
    if (list.dataset.key === key) return;
    const held = document.activeElement?.dataset.act;
    list.dataset.key = key;
    const out = streams().filter((kind) => !order.includes(kind));
    list.replaceChildren(...order.map((kind, i) => line(kind, i)), ...out.map((kind) => line(kind, null)));
    if (held) list.querySelector(`[data-act="${held}"]:not(:disabled)`)?.focus();
  }

  function line(kind, place) {
    const move = (by) => {
      const order = [...value()];
      [order[place], order[place + by]] = [order[place + by], order[place]];
      change(order);
    };
    const toggle = () => change(place === null ? [...value(), kind] : value().filter((k) => k !== kind));
    const button = (act, name, sign, onclick, off) => h("button", { type: "button", title: name, "aria-label": `${name}: ${nameOf(kind)}`, data: { act: `${act}-${kind}` }, disabled: off, onclick }, sign);
    const box = h("input", { type: "checkbox", checked: place !== null, "aria-label": nameOf(kind), data: { act: `use-${kind}` }, onchange: toggle });
    const name = h("span", { title: helpOf(kind) });
    text(name, nameOf(kind));
    const last = value().length - 1;
    return h("li", { data: { stream: kind } }, h("label", {}, box, name),
      button("up", "Earlier", "\u2191", () => move(-1), place === null || place === 0),
      button("down", "Later", "\u2193", () => move(1), place === null || place === last));
  }
}
