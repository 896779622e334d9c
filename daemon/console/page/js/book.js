// The operator's own names, colours and merges of labels. They are kept in this browser only, for each mission, vehicle and
// epoch, and are not sent: the vehicle knows label numbers only. See README.md.

import { recall, remember } from "./prefs.js";
import { store } from "./store.js";
import { current as theme } from "./theme.js";
import { redShade, rgb, tableColour } from "./palette.js";

const EMPTY = { names: {}, colours: {}, merged: {} };
let loadedKey = null;
let book = EMPTY;

function key() {
  const v = store.vehicle;
  const mission = store.snapshot?.mission;
  return `book.${mission?.id ?? ""}.${v?.id ?? 0}.${v?.map.epoch ?? 0}`;
}

function current() {
  if (key() !== loadedKey) {
    loadedKey = key();
    book = { ...structuredClone(EMPTY), ...recall(loadedKey, {}) };
  }
  return book;
}

function change(edit) {
  edit(current());
  remember(loadedKey, book);
  store.emit("book");
}

/** The label that `id` is shown as: itself, or the label that it was merged into. */
export function shownAs(id) {
  const { merged } = current();
  let at = id;
  for (let i = 0; merged[at] && i < 254; i += 1) at = merged[at];
  return at;
}

export const nameOf = (id) => current().names[id] ?? `Label ${id}`;
export const hasName = (id) => current().names[id] !== undefined;
export const colourOf = (id) => current().colours[id] ?? tableColour(id);

/** [r, g, b] in which `id` is painted now: its colour, or a shade of red in the red theme. */
export const tintOf = (id) => (theme() === "red" ? redShade(id) : rgb(colourOf(id)));

export function rename(id, name) {
  change((b) => {
    if (name.trim() === "" || name.trim() === `Label ${id}`) delete b.names[id];
    else b.names[id] = name.trim().slice(0, 40);
  });
}

export function recolour(id, colour) {
  change((b) => {
    if (colour === tableColour(id)) delete b.colours[id];
    else b.colours[id] = colour;
  });
}

export function merge(id, into) {
  if (shownAs(into) === id) return;
  change((b) => {
    b.merged[id] = into;
  });
}

export function split(id) {
  change((b) => {
    for (const [from, into] of Object.entries(b.merged)) if (into === id) delete b.merged[from];
  });
}

/** The vehicle's labels as the operator sees them: merged ones summed up, each with its `members`. */
export function shownLabels(vehicle) {
  const ids = new Set(vehicle.labels.map((l) => l.id));
  const shown = new Map();
  for (const label of vehicle.labels) {
    const into = shownAs(label.id);
    const id = ids.has(into) ? into : label.id;
    if (!shown.has(id)) shown.set(id, { members: [], cells: 0, area_m2: 0 });
    const sum = shown.get(id);
    sum.members.push(label.id);
    sum.cells += label.cells;
    sum.area_m2 += label.area_m2;
  }
  return vehicle.labels.filter((l) => shown.has(l.id)).map((l) => ({ ...l, ...shown.get(l.id) }));
}
