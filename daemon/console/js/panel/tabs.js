// On narrow screens the panels share one place; these are their tabs.

import { $, h } from "../dom.js";

const PANELS = [["labels", "Labels"], ["vehicle", "Vehicle"], ["link", "Link"]];

export function startTabs() {
  const bar = $("tabs");
  for (const [id, name] of PANELS) {
    bar.append(h("button", { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": id, onclick: () => choose(id) }, name));
  }
  bar.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const at = PANELS.findIndex(([id]) => id === document.body.dataset.tab);
    const [next] = PANELS[(at + step + PANELS.length) % PANELS.length];
    choose(next);
    $(`tab-${next}`).focus();
  });
  choose("labels");
}

function choose(chosen) {
  document.body.dataset.tab = chosen;
  for (const [id] of PANELS) {
    const tab = $(`tab-${id}`);
    tab.setAttribute("aria-selected", String(id === chosen));
    tab.tabIndex = id === chosen ? 0 : -1;
  }
}
