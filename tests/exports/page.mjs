// Makes the files that the page exports, from a map and a state that the daemon told: node page.mjs DIR
//
// The page's own modules run here; the few things of a browser that they touch while loading are empty.

import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

globalThis.localStorage = { getItem: () => null, setItem() {}, length: 0, key: () => null, removeItem() {} };
globalThis.document = { getElementById: () => null, createElement: () => ({}), addEventListener() {}, documentElement: { dataset: {} }, querySelector: () => null };
globalThis.matchMedia = () => ({ matches: false, addEventListener() {} });

const { toCsv, toGeoJson, toPly, toProjection, toWorldFile } = await import("../../daemon/console/js/export/formats.js");
const { store } = await import("../../daemon/console/js/store.js");

const dir = process.argv[2];
const told = JSON.parse(readFileSync(join(dir, "map.json"), "utf8"));
const state = JSON.parse(readFileSync(join(dir, "state.json"), "utf8"));
const bytes = (base64) => new Uint8Array(Buffer.from(base64, "base64"));
const ages = bytes(told.age_s);
const map = {
  ...told, planes: [], epoch: 0, labels: bytes(told.labels),
  age: Uint16Array.from({ length: ages.length / 2 }, (_, i) => ages[2 * i] | (ages[2 * i + 1] << 8)),
};
store.snapshot = state;
store.selectedId = state.vehicles[0].id;
const { origin } = state.mission;
const files = {
  "page.csv": toCsv(map, state.vehicles[0], 0), "page.geojson": toGeoJson(map, state.vehicles[0], origin, told.at_s),
  "page.ply": toPly(map, state.vehicles[0]), "page.pgw": toWorldFile(map, state.vehicles[0]), "page.png.aux.xml": toProjection(origin),
};
for (const [name, text] of Object.entries(files)) if (text !== null) writeFileSync(join(dir, name), text);
