// The tabs of the panels that share one place. On wide screens the labels have their own place, and vehicle and link share a tab.

import { $, h } from "../dom.js";
import { store } from "../store.js";

const PANELS = [["labels", "Labels"], ["vehicle", "Vehicle"], ["constraints", "Constraints"], ["link", "Link"], ["model", "Model"], ["log", "Log"]];
const WIDE = matchMedia("(min-width: 1101px)");
const ofWide = (id) => (["constraints", "model", "log"].includes(id) ? id : "vehicle");

export function startTabs() {
  const bar = $("tabs");
  for (const [id, name] of PANELS) {
    bar.append(h("button", { type: "button", role: "tab", id: `tab-${id}`, "aria-controls": id, onclick: () => choose(id) }, name));
  }
  bar.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const offered = PANELS.filter(([id]) => !WIDE.matches || ofWide(id) === id);
    const at = offered.findIndex(([id]) => id === document.body.dataset.tab);
    const [next] = offered[(at + step + offered.length) % offered.length];
    choose(next);
    $(`tab-${next}`).focus();
  });
  WIDE.addEventListener("change", () => choose(WIDE.matches ? ofWide(document.body.dataset.tab) : document.body.dataset.tab));
  choose(WIDE.matches ? "vehicle" : "labels");
}

function choose(chosen) {
  document.body.dataset.tab = chosen;
  for (const [id] of PANELS) {
    const tab = $(`tab-${id}`);
    tab.setAttribute("aria-selected", String(id === chosen));
    tab.tabIndex = id === chosen ? 0 : -1;
  }
  store.emit("tab");
}
