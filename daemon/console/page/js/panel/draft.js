// Weights that the operator has moved but not sent, and those sent but not yet in the server's state.

import { sendUtility } from "../api.js";
import { store } from "../store.js";
import { slotOf } from "./lifeline.js";
import { Ours } from "./ours.js";

const drafts = new Map();
/** Weights of cells rather than labels, and what they are where the daemon does not say. */
export const TERMS = { exploration: 0.2, curiosity: 0 };
export const ours = new Ours("utility");

/** The draft of the chosen vehicle: weights by label id with the server's value they started from. */
export function draft() {
  const id = store.selectedId;
  if (!drafts.has(id)) drafts.set(id, { weights: new Map(), terms: new Map(), sentVersion: null, error: null, busy: false });
  return drafts.get(id);
}

const same = (a, b) => Math.abs(a - b) < 1e-6;

export const serverTerm = (vehicle, name) => vehicle.utility?.[name] ?? null;

export const term = (vehicle, name) => draft().terms.get(name)?.value ?? serverTerm(vehicle, name) ?? TERMS[name];

export const weight = (label) => draft().weights.get(label.id)?.value ?? label.weight;

/** What a further edit starts from: its own start, what we sent if that is on its way, or the server's value. */
const startOf = (mine, server) => (!mine ? server : mine.sent ? mine.value : mine.base);

export function setWeight(label, value) {
  const { weights } = draft();
  const base = startOf(weights.get(label.id), label.weight);
  if (same(value, base)) weights.delete(label.id);
  else weights.set(label.id, { value, base, sent: false });
  store.tell("draft");
}

export function setTerm(vehicle, name, value) {
  const { terms } = draft();
  const base = startOf(terms.get(name), serverTerm(vehicle, name));
  if (same(value, base ?? NaN)) terms.delete(name);
  else terms.set(name, { value, base, sent: false });
  store.tell("draft");
}

export function discard() {
  draft().error = null;
  draft().weights.clear();
  draft().terms.clear();
  store.tell("draft");
}

const moved = () => [...draft().weights.values(), ...draft().terms.values()];

/** How many values differ from what was sent. */
export const unsent = () => moved().filter((m) => !m.sent).length;

/** The server's weight when somebody else changed it under our draft, else null. */
export function changedElsewhere(label) {
  const d = draft().weights.get(label.id);
  return d && !d.sent && draft().sentVersion === null && !same(label.weight, d.base) ? label.weight : null;
}

/** Whether somebody else changed under our draft the weight of unseen or of puzzling ground. */
export const termsChangedElsewhere = (vehicle) =>
  draft().sentVersion === null && [...draft().terms].some(([name, t]) => !t.sent && t.base !== null && !same(serverTerm(vehicle, name) ?? NaN, t.base));

/** Drops sent values once the server's own state carries them. */
export function settle(vehicle) {
  const d = draft();
  const slot = slotOf(vehicle, "utility");
  if (d.sentVersion === null || !slot || slot.version < d.sentVersion) return;
  for (const [id, w] of d.weights) if (w.sent) d.weights.delete(id);
  for (const [name, t] of d.terms) if (t.sent && serverTerm(vehicle, name) !== null) d.terms.delete(name);
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
  const sending = moved();
  const terms = Object.fromEntries(Object.keys(TERMS).map((name) => [name, term(vehicle, name)]));
  try {
    const answer = await sendUtility(vehicle.id, { weights, ...terms });
    d.sentVersion = answer.version;
    ours.sent(vehicle, answer.version);
    for (const m of sending) m.sent = true;
  } catch (error) {
    d.error = error.message;
  }
  d.busy = false;
  store.tell("draft");
}
