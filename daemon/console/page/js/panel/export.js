// The export dialog: the files of the map, made by the server.

import { archivedMaps } from "./archive.js";
import { cut, finestCut } from "../book.js";
import { BASE } from "../api.js";
import { $, h } from "../dom.js";
import { ago, utc } from "../format.js";
import { ageOf, store } from "../store.js";

/** Title, hint, and the extension of each file. */
const FILES = [
  ["PNG", "one pixel a cell, pixel value = label", "png"],
  ["World file", "the place of the PNG, beside it", "pgw"],
  ["Projection", "projection and classes of the PNG, beside it", "png.aux.xml"],
  ["GeoTIFF", "one pixel a cell, of any extent, pixel value = label", "tif"],
  ["GeoTIFF, UTM", "the same in the UTM zone of the origin", "utm.tif"],
  ["GeoTIFF, WGS 84", "the same in longitude and latitude", "wgs84.tif"],
  ["Classes", "the names of the classes, beside the GeoTIFF", "tif.aux.xml"],
  ["Classes, UTM", "the same beside the GeoTIFF in UTM", "utm.tif.aux.xml"],
  ["Classes, WGS 84", "the same beside the GeoTIFF in WGS 84", "wgs84.tif.aux.xml"],
  ["CSV", "one line a cell with label, age and layers", "csv"],
  ["Labels, CSV", "one line a label with name, area and its group at each cut of the tree", "labels.csv"],
  ["GeoJSON", "regions of equal label, and markers", "geojson"],
  ["COCO", "the classes as annotations of the PNG", "coco.json"],
  ["TagLab", "the classes as labels; the PNG is the label image", "taglab.json"],
  ["PLY", "coloured points for 3-D tools", "ply"],
];

const NEEDS_ORIGIN = ["utm.tif", "wgs84.tif", "utm.tif.aux.xml", "wgs84.tif.aux.xml"];
/** A PNG has no empty tiles: the server makes none of more cells than this. */
const PNG_FILES = ["png", "pgw", "png.aux.xml", "coco.json", "taglab.json"];
const MAX_PNG_CELLS = 2 ** 23;

/** Whether the server can make a file of this map. */
function isOffered(extension, { mission }, map) {
  if (NEEDS_ORIGIN.includes(extension)) return Boolean(mission.origin);
  return !PNG_FILES.includes(extension) || map.width * map.height <= MAX_PNG_CELLS;
}

export function openExport() {
  const { map, vehicle } = store;
  const dialog = $("dialog");
  const close = h("button.primary", { type: "button", onclick: () => dialog.close() }, "Close");
  dialog.replaceChildren(h("h2", { id: "dialog-title" }, "Export the map"), ...(map && !map.isEmpty ? offer(vehicle) : [h("p", {}, "No cell has arrived yet.")]), report(), archivedMaps(), h("div.buttons", {}, close));
  dialog.showModal();
}

function offer(vehicle) {
  const { mission } = store.snapshot;
  // The maps of a record are numbered by when they were asked for.
  const which = store.replay ? utc(store.replay.at_utc_s) : `v${vehicle.map.version}`;
  const name = `${mission.name}-${vehicle.name}-${which}`.replace(/[^\w.-]+/g, "_");
  const shown = cut(vehicle);
  const isGrouped = shown < finestCut(vehicle);
  const query = (extension) => (isGrouped && extension !== "labels.csv" ? `?labels=${shown}` : "");
  const item = ([title, hint, extension]) =>
    h("li", {}, h("a", { href: `${BASE}/vehicles/${vehicle.id}/map.${extension}${query(extension)}`, download: `${name}.${extension}` }, title), h("span.hint", {}, hint));
  const local = mission.origin ? "" : " The mission has no origin in latitude and longitude: coordinates are metres east and north.";
  return [
    h("p", {}, `${store.replay ? `The map in view at ${which}` : `Version ${vehicle.map.version}`} of ${vehicle.name}, changed ${ago(ageOf(vehicle.map.updated_s))}.${local}`),
    h("ul.files", {}, ...FILES.filter(([, , extension]) => isOffered(extension, store.snapshot, vehicle.map)).map(item)),
    h("p.hint", {}, `Files keep the numbers of labels${isGrouped ? `, of the ${shown} that the page shows` : ""}, with names, colours and what each is merged into.`),
  ];
}

/** The whole dive as one file: the server makes it of the record. */
function report() {
  const name = `${store.snapshot.mission.name}-report.html`.replace(/[^\w.-]+/g, "_");
  return h("p", {}, h("a", { href: `${BASE}/report.html`, download: name }, "Report of the dive"), h("span.hint", {}, " summary, map, areas, images, orders and link in one HTML file"));
}
