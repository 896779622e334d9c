// The order of weights: one part for each label by its number, one for unexplored and one for surprising ground. The surface keeps
// what is set and not sent.

import { keepDraft, sendUtility } from "../api.js";
import { isMerged, shownLabels } from "../book.js";
import { Order } from "../order/order.js";
import { SharedDraft } from "../order/shared-draft.js";

/** Weights of ground rather than of labels. */
export const TERMS = ["exploration", "curiosity"];

const read = (vehicle, part) =>
  TERMS.includes(part) ? vehicle.utility[part] : vehicle.labels.find((l) => l.id === part)?.weight ?? 0;

/** The slot is replaced as a whole, so each label's weight is sent. A merged label takes that of the label it is part of; a label of
 * a group of the tree takes a weight that is set for the group, and keeps its own as long as none is. */
export function utilityOf(vehicle, value) {
  const weights = {};
  for (const label of shownLabels(vehicle)) {
    const isSet = value(label.id) !== read(vehicle, label.id);
    for (const member of label.members) weights[member] = isSet || isMerged(member) ? value(label.id) : read(vehicle, member);
  }
  return { weights, ...Object.fromEntries(TERMS.map((term) => [term, value(term)])) };
}

/** The weights in force, as an order has them. */
export const weightsInForce = (vehicle) => utilityOf(vehicle, (part) => read(vehicle, part));

const post = (vehicle, value) => sendUtility(vehicle.id, utilityOf(vehicle, value));

/** Whether the labels of a group have different weights, and none was set for the group. */
export const isMixed = (vehicle, label) =>
  !weightsOrder.isChanged(vehicle, label.id) && label.members.some((member) => !isMerged(member) && read(vehicle, member) !== read(vehicle, label.id));

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
