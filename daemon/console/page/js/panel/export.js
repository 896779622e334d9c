// The export dialog: the files of the map, made by the server.

import { archivedMaps } from "./archive.js";
import { BASE } from "../api.js";
import { $, h } from "../dom.js";
import { ago } from "../format.js";
import { ageOf, store } from "../store.js";

/** Title, hint, and the extension of each file. */
const FILES = [
  ["PNG", "one pixel a cell, pixel value = label", "png"],
  ["World file", "the place of the PNG, beside it", "pgw"],
  ["Projection", "the projection of the PNG, beside it", "png.aux.xml"],
  ["CSV", "one line a cell with label, age and layers", "csv"],
  ["GeoJSON", "regions of equal label", "geojson"],
  ["PLY", "coloured points for 3-D tools", "ply"],
];

export function openExport() {
  const { map, vehicle } = store;
  const dialog = $("dialog");
  const close = h("button.primary", { type: "button", onclick: () => dialog.close() }, "Close");
  dialog.replaceChildren(h("h2", { id: "dialog-title" }, "Export the map"), ...(map && map.width > 0 ? offer(vehicle) : [h("p", {}, "No cell has arrived yet.")]), archivedMaps(), h("div.buttons", {}, close));
  dialog.showModal();
}

function offer(vehicle) {
  const { mission } = store.snapshot;
  const name = `${mission.name}-${vehicle.name}-v${vehicle.map.version}`.replace(/[^\w.-]+/g, "_");
  const item = ([title, hint, extension]) =>
    h("li", {}, h("a", { href: `${BASE}/vehicles/${vehicle.id}/map.${extension}`, download: `${name}.${extension}` }, title), h("span.hint", {}, hint));
  const local = mission.origin ? "" : " The mission has no origin in latitude and longitude: coordinates are metres east and north.";
  return [
    h("p", {}, `Version ${vehicle.map.version} of ${vehicle.name}, changed ${ago(ageOf(vehicle.map.updated_s))}.${local}`),
    h("ul.files", {}, ...FILES.map(item)),
    h("p.hint", {}, "Files have label numbers, without names, colours and merges."),
  ];
}
