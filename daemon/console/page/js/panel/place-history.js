// The labels that the cell of the chosen place had before its present one.

import { readCellHistory } from "../api.js";
import { nameOf, shownAs } from "../book.js";
import { ago } from "../format.js";
import { ageOf, store } from "../store.js";

const MAX_LINES = 4;
/** What was last read: vehicle, cell and its label as one text, in a record with the version of the map, and the former labels, the
 * newest first. */
const read = { cell: "", key: "", former: [] };

/** One line for each former label of a cell, as `cellAt` gives it, or of null. `changed` is called when they have arrived. */
export function historyLines(cell, changed) {
  const at = cell ? [store.selectedId, ...cell.at, cell.label].join() : "";
  const key = cell && store.replay ? `${at} ${store.map.version}` : at;
  if (key !== read.key) {
    Object.assign(read, { cell: at, key, former: at === read.cell ? read.former : [] });
    if (cell) load(key, cell, changed);
  }
  // Labels that the operator shows as one are one here.
  const changes = read.former.filter((f, i) => shownAs(f.label) !== shownAs(i === 0 ? cell.label : read.former[i - 1].label));
  return changes.slice(0, MAX_LINES).map((f) => `${nameOf(shownAs(f.label))} until ${ago(ageOf(f.until_s))}`);
}

async function load(key, cell, changed) {
  // Without an answer the plate shows no history; the next change of the cell asks again.
  const former = await readCellHistory(store.selectedId, ...cell.at).catch(() => []);
  if (read.key !== key) return;
  read.former = former;
  changed();
}
