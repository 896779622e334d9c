// The panel of constraints: fence, limits and weighted areas.

import { lockInRecord } from "../command.js";
import { $, h } from "../dom.js";
import { areasOrder, fenceOrder, finish, pen } from "../fence/edit.js";
import { store } from "../store.js";
import { areasPart, update as updateAreas } from "./areas.js";
import { fencePart, update as updateFence } from "./fence.js";
import { limitsOrder, limitsPart, update as updateLimits } from "./limits.js";

export function startConstraints() {
  $("constraints").append(h("header", {}, h("h2", { id: "constraints-title" }, "Constraints")), fencePart, areasPart, limitsPart);
  store.on("state select edit feed", update);
  store.on("tick", () => pen.shown && update());
  store.on("tab", () => {
    const shown = document.body.dataset.tab === "constraints";
    if (pen.shown && !shown && store.vehicle && pen.tool) finish();
    pen.shown = shown;
    update();
    store.emit("edit");
  });
}

function update() {
  updateFence();
  updateAreas();
  updateLimits();
  lockInRecord($("constraints"), ".outline .quiet");
  const v = store.vehicle;
  const unsent = Boolean(v) && [fenceOrder, areasOrder, limitsOrder].some((order) => order.isChanged(v));
  $("tab-constraints").classList.toggle("unsent", unsent);
  $("tab-constraints").title = unsent ? "Edits that are not sent" : "";
}
