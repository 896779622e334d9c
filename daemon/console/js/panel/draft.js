// Weights that the operator has moved but not sent, and those sent but not yet in the server's state.

import { sendUtility } from "../api.js";
import { store } from "../store.js";
import { slotOf } from "./lifeline.js";

const drafts = new Map();
const DEFAULT_EXPLORATION = 0.2;

/** The draft of the chosen vehicle: weights by label id with the server's value they started from. */
export function draft() {
  const id = store.selectedId;
  if (!drafts.has(id)) drafts.set(id, { weights: new Map(), exploration: null, sentVersion: null, error: null, busy: false });
  return drafts.get(id);
}

const same = (a, b) => Math.abs(a - b) < 1e-6;

export const serverExploration = (vehicle) => vehicle.utility?.exploration ?? null;

export function exploration(vehicle) {
  return draft().exploration ?? serverExploration(vehicle) ?? DEFAULT_EXPLORATION;
}

export const weight = (label) => draft().weights.get(label.id)?.value ?? label.weight;

export function setWeight(label, value) {
  const { weights } = draft();
  const base = weights.get(label.id)?.base ?? label.weight;
  if (same(value, base)) weights.delete(label.id);
  else weights.set(label.id, { value, base, sent: false });
  store.tell("draft");
}

export function setExploration(vehicle, value) {
  draft().exploration = value === serverExploration(vehicle) ? null : value;
  draft().explorationSent = false;
  store.tell("draft");
}

export function discard() {
  Object.assign(draft(), { exploration: null, error: null });
  draft().weights.clear();
  store.tell("draft");
}

/** How many values differ from what was sent. */
export function unsent() {
  const d = draft();
  const moved = [...d.weights.values()].filter((w) => !w.sent).length;
  return moved + (d.exploration !== null && !d.explorationSent ? 1 : 0);
}

/** The server's weight when somebody else changed it under our draft, else null. */
export function changedElsewhere(label) {
  const d = draft().weights.get(label.id);
  return d && !d.sent && !same(label.weight, d.base) ? label.weight : null;
}

/** Drops sent values once the server's own state carries them. */
export function settle(vehicle) {
  const d = draft();
  const slot = slotOf(vehicle, "utility");
  if (d.sentVersion === null || !slot || slot.version < d.sentVersion) return;
  for (const [id, w] of d.weights) if (w.sent) d.weights.delete(id);
  if (d.explorationSent && serverExploration(vehicle) !== null) d.exploration = null;
  d.sentVersion = null;
}

/** Sends the weights of all labels: the slot is replaced as a whole. `labels` are the shown ones. */
export async function send(vehicle, labels) {
  const d = draft();
  const weights = {};
  for (const label of labels) for (const member of label.members) weights[member] = weight(label);
  d.busy = true;
  d.error = null;
  store.tell("draft");
  const moved = [...d.weights.entries()];
  try {
    const answer = await sendUtility(vehicle.id, weights, exploration(vehicle));
    d.sentVersion = answer.version;
    for (const [id, w] of moved) if (d.weights.get(id) === w) w.sent = true;
    if (d.exploration !== null) d.explorationSent = true;
  } catch (error) {
    d.error = error.message;
  }
  d.busy = false;
  store.tell("draft");
}
