// What left-over bits are spent on, in an order that is moved up and down or left out.

import { h, show, text } from "../dom.js";

const WHAT = {
  finer: "finer cells, while the map comes coarsely",
  depth: "depth",
  exemplars: "pictures of new labels",
  confidence: "confidence",
  curiosity: "curiosity",
};
const KINDS = Object.keys(WHAT);

/** `value` gives the order, `change` takes another. */
export function spendBox(value, change) {
  const list = h("ol", {});
  const none = h("p.note", {}, "Nothing: left-over bits are saved.");
  const node = h("div.spend", { role: "group", "aria-label": "What left-over bits are spent on" },
    h("h3", {}, "Left-over bits, first to last"), list, none);
  return { node, refresh };

  function refresh(order) {
    show(node, order !== null);
    if (order === null) return;
    show(none, order.length === 0);
    const key = order.join();
    if (list.dataset.key === key) return;
    const held = document.activeElement?.dataset.act;
    list.dataset.key = key;
    const out = KINDS.filter((kind) => !order.includes(kind));
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
    const button = (act, name, sign, onclick, off) => h("button", { type: "button", title: name, "aria-label": `${name}: ${WHAT[kind]}`, data: { act: `${act}-${kind}` }, disabled: off, onclick }, sign);
    const box = h("input", { type: "checkbox", checked: place !== null, "aria-label": WHAT[kind], data: { act: `use-${kind}` }, onchange: toggle });
    const name = h("span", {});
    text(name, WHAT[kind]);
    const last = value().length - 1;
    return h("li", { data: { spend: kind } }, h("label", {}, box, name),
      button("up", "Earlier", "\u2191", () => move(-1), place === null || place === 0),
      button("down", "Later", "\u2193", () => move(1), place === null || place === last));
  }
}
