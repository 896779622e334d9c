// The export dialog: every file is made here from the map on the screen.

import { shownAs, colourOf } from "../book.js";
import { $, download, h } from "../dom.js";
import { ago } from "../format.js";
import { paintLabels } from "../map/raster.js";
import { rgb } from "../palette.js";
import { ageOf, store } from "../store.js";
import { toCsv, toGeoJson, toPly, toProjection, toWorldFile } from "./formats.js";

async function png(map, name) {
  const tintOf = (id) => rgb(colourOf(id));
  const canvas = paintLabels(map, { tintOf, shownAs, stale: false, highlight: null });
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  download(`${name}.png`, "image/png", [blob]);
  download(`${name}.pgw`, "text/plain", [toWorldFile(map, store.vehicle)]);
  const projection = toProjection(store.snapshot.mission.origin);
  if (projection) download(`${name}.png.aux.xml`, "application/xml", [projection]);
}

const FILES = [
  ["PNG and world file", "one pixel a cell, as coloured here", png],
  ["CSV", "one line a cell with label and age", (map, name) => download(`${name}.csv`, "text/csv", [toCsv(map, store.vehicle, ageOf(map.fetchedS))])],
  ["GeoJSON", "regions of equal label", (map, name) =>
    download(`${name}.geojson`, "application/geo+json", [toGeoJson(map, store.vehicle, store.snapshot.mission.origin, store.nowS)])],
  ["PLY", "coloured points for 3-D tools", (map, name) => download(`${name}.ply`, "application/octet-stream", [toPly(map, store.vehicle)])],
];

export function openExport() {
  const { map, vehicle } = store;
  const dialog = $("dialog");
  const close = h("button.primary", { type: "button", onclick: () => dialog.close() }, "Close");
  const ready = map && map.width > 0;
  const name = ready ? `${store.snapshot.mission.name}-${vehicle.name}-v${map.version}`.replace(/[^\w.-]+/g, "_") : "";
  const items = FILES.map(([what, hint, make]) =>
    h("li", {}, h("button", { type: "button", onclick: () => make(map, name) }, what), h("span.hint", {}, hint)));
  const local = store.snapshot?.mission.origin ? "" : " The mission has no origin in latitude and longitude: coordinates are metres east and north.";
  dialog.replaceChildren(
    h("h2", { id: "dialog-title" }, "Export the map"),
    ready ? h("p", {}, `Version ${map.version} of ${vehicle.name}, changed ${ago(ageOf(vehicle.map.updated_s))}.${local}`) : h("p", {}, "No cell has arrived yet."),
    ready ? h("ul.files", {}, ...items,
      h("li", {}, h("a", { href: `/api/v1/vehicles/${vehicle.id}/map.png`, download: `${name}-ids.png` }, "Indexed PNG"), h("span.hint", {}, "label numbers, as scenecast writes it"))) : null,
    h("div.buttons", {}, close));
  dialog.showModal();
}
