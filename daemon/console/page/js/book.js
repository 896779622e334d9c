// The operator's own names, colours and merges of labels. The surface keeps them for each vehicle and epoch; this browser has
// a copy. They are not sent to the vehicle, which knows label numbers only. See README.md.

import { saveLabel } from "./api.js";
import { announce } from "./dom.js";
import { recall, remember } from "./prefs.js";
import { store } from "./store.js";
import { current as theme } from "./theme.js";
import { redShade, rgb, tableColour } from "./palette.js";

const EMPTY = { names: {}, colours: {}, merged: {} };
let loadedKey = null;
let book = EMPTY;
/** Labels with a change that is not sent, and those of which one is on its way. A label has one request at a time, so that no
 * change overtakes a later one. */
const unsent = new Set();
const onTheWay = new Set();

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

/** Changes the book and sends the entry of `id` to the surface, whose next state has it. */
function change(id, edit) {
  edit(current());
  remember(loadedKey, book);
  store.emit("book");
  send(id);
}

/** Sends the entry of `id` once the changes of this moment are all made. */
function send(id) {
  if (!store.vehicle) return;
  unsent.add(id);
  queueMicrotask(flush);
}

function flush() {
  for (const id of [...unsent].filter((waiting) => !onTheWay.has(waiting))) {
    const entry = { label: id, name: book.names[id] ?? null, colour: book.colours[id] ?? null, merged_into: book.merged[id] ?? null };
    unsent.delete(id);
    onTheWay.add(id);
    saveLabel(store.vehicle.id, entry).catch((error) => announce(error.message)).finally(() => {
      onTheWay.delete(id);
      flush();
    });
  }
}

/** Takes the entries of the surface over, which other consoles may have changed. */
function take() {
  const b = current();
  if (unsent.size + onTheWay.size > 0) return;
  let changed = false;
  const put = (part, id, value) => {
    if (value === undefined || (b[part][id] ?? null) === value) return;
    if (value === null) delete b[part][id];
    else b[part][id] = value;
    changed = true;
  };
  const entries = store.vehicle?.label_book ?? {};
  for (const id of new Set([...(store.vehicle?.labels ?? []).map((l) => l.id), ...Object.keys(entries).map(Number)])) {
    const entry = store.vehicle.label_book && { name: null, colour: null, merged_into: null, ...entries[id] };
    put("names", id, entry?.name);
    put("colours", id, entry?.colour);
    put("merged", id, entry?.merged_into);
  }
  if (changed) {
    remember(loadedKey, b);
    store.emit("book");
  }
}
store.on("state select", take);

/** The number of labels that the vehicle's tree can tell apart; 0 without a tree. */
export const finestCut = (vehicle) => (vehicle?.label_tree ? vehicle.label_tree.merges.length + 1 : 0);

const cutKey = (vehicle) => `label-cut ${vehicle?.id}`;

/** The number of labels at the cut in view. The operator's choice for a vehicle stays in this browser; without one all are shown. */
export function cut(vehicle) {
  const finest = finestCut(vehicle);
  return Math.min(finest, recall(cutKey(vehicle), finest) ?? finest);
}

/** Cuts the tree at `count` labels; null: all labels, also those to come. */
export function setCut(count) {
  remember(cutKey(store.vehicle), count);
  store.emit("book");
}

/** The label that stands for `id` at the cut in view. */
function groupOf(id) {
  const { vehicle } = store;
  const merges = vehicle?.label_tree?.merges ?? [];
  return merges.slice(0, finestCut(vehicle) - cut(vehicle)).reduce((at, [into, joins]) => (at === joins ? into : at), id);
}

/** The label that `id` is shown as: itself, the label that it was merged into, or the one that stands for it at the cut in view. */
export function shownAs(id) {
  const { merged } = current();
  let at = groupOf(id);
  for (let i = 0; merged[at] && i < 254; i += 1) at = groupOf(merged[at]);
  return at;
}

/** Whether the operator has merged `id`, or the label that stands for it, into another one. */
export const isMerged = (id) => Boolean(current().merged[id] ?? current().merged[groupOf(id)]);

/** The name of the largest label that `id` stands for and that has one. */
function nameOfMember(id) {
  const members = (store.vehicle?.labels ?? []).filter((l) => current().names[l.id] !== undefined && groupOf(l.id) === id);
  return members.sort((a, b) => b.cells - a.cells)[0]?.id;
}

/** The operator's name of `id`; a label without one that stands for others has the name of the largest of these. */
export const nameOf = (id) => current().names[id] ?? current().names[nameOfMember(id)] ?? `Label ${id}`;
export const hasName = (id) => current().names[id] !== undefined;
export const colourOf = (id) => current().colours[id] ?? tableColour(id);

/** [r, g, b] in which `id` is painted now: its colour, or a shade of red in the red theme. */
export const tintOf = (id) => (theme() === "red" ? redShade(id) : rgb(colourOf(id)));

export function rename(id, name) {
  change(id, (b) => {
    if (name.trim() === "" || name.trim() === `Label ${id}`) delete b.names[id];
    else b.names[id] = name.trim().slice(0, 40);
  });
}

export function recolour(id, colour) {
  change(id, (b) => {
    if (colour === tableColour(id)) delete b.colours[id];
    else b.colours[id] = colour;
  });
}

export function merge(id, into) {
  if (shownAs(into) === id) return;
  change(id, (b) => {
    b.merged[id] = into;
  });
}

export function split(id) {
  for (const [from, into] of Object.entries({ ...current().merged })) {
    if (into === id) change(Number(from), (b) => delete b.merged[from]);
  }
}

/** The vehicle's labels as the operator sees them: merged ones summed up, each with its `members`. */
export function shownLabels(vehicle) {
  const shown = new Map();
  for (const label of vehicle.labels) {
    const id = shownAs(label.id);
    if (!shown.has(id)) shown.set(id, { members: [], cells: 0, area_m2: 0, gained_m2: 0 });
    const sum = shown.get(id);
    sum.members.push(label.id);
    sum.cells += label.cells;
    sum.area_m2 += label.area_m2;
    sum.gained_m2 += label.gained_m2 ?? 0;
  }
  // A label without cells of its own has the rest (weight, images) of its first member.
  const whole = (id, sum) => vehicle.labels.find((l) => l.id === id) ?? { ...vehicle.labels.find((l) => l.id === sum.members[0]), id };
  const inOrder = [...shown].sort(([a], [b]) => a - b);
  return inOrder.map(([id, sum]) => ({ ...whole(id, sum), ...sum }));
}
