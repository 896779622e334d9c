// The list of archived maps in the export dialog: maps of runs and label epochs that have ended.

import { BASE, readArchive } from "../api.js";
import { h } from "../dom.js";
import { ago } from "../format.js";
import { ageOf } from "../store.js";

const FORMATS = ["png", "csv", "geojson", "ply"];

/** The list, which fills itself; it stays empty without archived maps. */
export function archivedMaps() {
  const section = h("section.archive", {});
  readArchive()
    .then((maps) => {
      if (maps.length > 0) section.replaceChildren(h("h3", {}, "Maps of earlier runs"), h("ul.files", {}, ...maps.map(item)));
    })
    .catch(() => {});
  return section;
}

function item(map) {
  const title = `${map.vehicle_name}, run ${map.run}, label epoch ${map.epoch}`;
  const link = (extension) =>
    h("a", { href: `${BASE}/archive/${map.name}/map.${extension}`, download: `${map.name}.${extension}` }, extension.toUpperCase());
  const links = FORMATS.flatMap((extension) => [" ", link(extension)]);
  return h("li", {}, title, ...links, h("span.hint", {}, `${map.cells} cells, ended ${ago(ageOf(map.ended_s))}`));
}
