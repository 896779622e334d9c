// The order of weights: one part for each label by its number, one for unexplored and one for surprising ground. The surface keeps
// what is set and not sent.

import { keepDraft, sendUtility } from "../api.js";
import { shownLabels } from "../book.js";
import { Order } from "../order/order.js";
import { SharedDraft } from "../order/shared-draft.js";

/** Weights of ground rather than of labels. */
export const TERMS = ["exploration", "curiosity"];

const read = (vehicle, part) =>
  TERMS.includes(part) ? vehicle.utility[part] : vehicle.labels.find((l) => l.id === part)?.weight ?? 0;

/** The slot is replaced as a whole, so each label's weight is sent; a merged label takes that of the label it is part of. */
function post(vehicle, value) {
  const weights = {};
  for (const label of shownLabels(vehicle)) for (const member of label.members) weights[member] = value(label.id);
  return sendUtility(vehicle.id, { weights, ...Object.fromEntries(TERMS.map((term) => [term, value(term)])) });
}

export const weightsOrder = new Order("utility", read, post);

/** The draft at the surface, part by part. */
function readDraft({ draft }) {
  const weights = Object.entries(draft.weights).map(([label, weight]) => [Number(label), weight]);
  return { number: draft.number, parts: [...weights, ...TERMS.map((term) => [term, draft[term]]).filter(([, weight]) => weight !== null)] };
}

function writeDraft(vehicle, parts) {
  const all = new Map(parts);
  const terms = Object.fromEntries(TERMS.map((term) => [term, all.get(term) ?? null]));
  return keepDraft(vehicle.id, { weights: Object.fromEntries(parts.filter(([part]) => !TERMS.includes(part))), ...terms });
}

export const weightsDraft = new SharedDraft(weightsOrder, readDraft, writeDraft);
