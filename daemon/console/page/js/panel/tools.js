// The buttons along the map.

import { cloud, fitCloud, toggleCloud, zoomCloud } from "../cloud/cloud.js";
import { $, h, show } from "../dom.js";
import { plain } from "../format.js";
import { fit, follow, options, redraw, toggle, view } from "../map/chart.js";
import { layer, layerNames, setLayer } from "../map/layers.js";
import { measure, toggleMeasure } from "../map/measure.js";
import { store } from "../store.js";
import { openExport } from "./export.js";

const buttons = {};
const zoom = (factor) => () => {
  if (cloud.on) return zoomCloud(factor);
  view.zoomAt(view.width / 2, view.height / 2, factor);
  store.emit("view");
  redraw();
};

function button(name, label, title, onclick) {
  buttons[name] = h("button.tool", { type: "button", title, onclick }, label);
  if (title !== label && label.length < 2) buttons[name].setAttribute("aria-label", title);
  return buttons[name];
}

export function startTools() {
  const pick = h("select", { id: "layer", onchange: () => (setLayer(pick.value), redraw()) });
  const layers = h("label.tool-field", { title: "What the colours of the map show" }, "Layer", pick);
  const after = (fn) => () => {
    fn();
    mark();
    redraw();
  };
  $("tools").append(
    button("in", "+", "Zoom in", zoom(1.4)),
    button("out", "\u2212", "Zoom out", zoom(1 / 1.4)),
    button("fit", "Fit", "Show everything (0)", after(() => (cloud.on ? fitCloud() : fit()))),
    button("follow", "Follow", "Keep the vehicle in the middle (F)", after(follow)),
    layers,
    button("grid", "Grid", "Grid in metres", after(() => toggle("grid"))),
    button("rings", "Rings", "Range rings around the surface, or around the vehicle if the position of the surface is unknown", after(() => toggle("rings"))),
    button("cloud", "3-D", "Point cloud of the cells", after(toggleCloud)),
    button("measure", "Measure", "Measure distance and bearing (M)", after(toggleMeasure)),
    button("export", "Export", "PNG, CSV, GeoJSON, PLY", openExport),
  );
  store.on("view", () => (offer(pick), mark()));
  store.on("map select state", () => (offer(pick), mark()));
  offer(pick);
  mark();
}

function offer(pick) {
  const names = layerNames();
  if (names.join() !== [...pick.options].map((o) => o.value).join()) {
    pick.replaceChildren(...names.map((n) => h("option", { value: n }, plain(n))));
  }
  if (!names.includes(layer.name)) setLayer("label");
  pick.value = layer.name;
}

function mark() {
  const pressed = {
    fit: view.mode === "fit", follow: view.mode === "follow",
    grid: options.grid, rings: options.rings, measure: measure.on, cloud: cloud.on,
  };
  for (const [name, on] of Object.entries(pressed)) buttons[name].setAttribute("aria-pressed", String(on));
  for (const name of ["follow", "grid", "rings", "measure"]) show(buttons[name], !cloud.on);
  show($("layer").parentElement, !cloud.on && layerNames().length > 1);
  $("chart").classList.toggle("measuring", measure.on);
}
