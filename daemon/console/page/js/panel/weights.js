// The order of weights: one part for each label by its number, one for unexplored and one for surprising ground.

import { sendUtility } from "../api.js";
import { shownLabels } from "../book.js";
import { Order } from "../order/order.js";

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
