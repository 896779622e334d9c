// What the surface plans with the vehicle's own planner and sends nothing: the button Try beside Send asks what the vehicle would do by
// the weights as they are set, and the question below the vehicle's target why it does not go to a favoured label first.

import { dryRun } from "../api.js";
import { announce, h, show, text } from "../dom.js";
import { dryRunOf, forgetDryRun, showDryRun } from "../map/dry-run.js";
import { store } from "../store.js";
import { utilityOf, weightsInForce, weightsOrder } from "./weights.js";

/** What the colours of a plan mean, in the order of the legend. */
const REASONS = { label: "favoured label", expected: "label expected", unseen: "unseen floor", return: "return", other: "other" };
let busy = false;
let fault = "";
const button = h("button", { type: "button", id: "try-weights", title: "Show on the map what the vehicle would do by these weights; sends nothing", onclick: ask }, "Try");
const close = h("button.quiet", { type: "button", onclick: () => {
  forgetDryRun();
  refreshTry(store.vehicle);
} }, "Close dry run");
const words = h("p");
const rests = h("p.note");
const legend = h("p.reasons", {}, ...Object.entries(REASONS).map(([reason, name]) => h("span", { data: { reason } }, name)));
const card = h("div.dry-run", { hidden: true }, h("b", {}, "Dry run, not sent"), words, legend, rests, close);
const errorLine = h("p.note", { role: "alert", hidden: true, data: { state: "refused" } });

export const tryButton = button;
export const tryPart = h("div", {}, errorLine, card);

const weightsNow = (vehicle) => utilityOf(vehicle, (part) => weightsOrder.value(vehicle, part));

async function ask() {
  const { vehicle } = store;
  const weights = weightsNow(vehicle);
  [busy, fault] = [true, ""];
  refreshTry(vehicle);
  try {
    const run = await dryRun(vehicle.id, weights);
    announce(run.text);
    busy = false;
    showDryRun(vehicle, JSON.stringify(weights), run);
  } catch (error) {
    [busy, fault] = [false, error.message];
    refreshTry(vehicle);
  }
}

export function refreshTry(vehicle) {
  const run = dryRunOf(vehicle, JSON.stringify(weightsNow(vehicle)));
  button.disabled = busy || !store.connected || Boolean(store.replay) || vehicle.labels.length === 0;
  show(errorLine, fault !== "");
  text(errorLine, fault);
  show(card, run !== null && !weightsOrder.progress(vehicle).waiting);
  // What was sent or changed is no dry run any more.
  if (card.hidden) return forgetDryRun();
  text(words, run.text);
  text(rests, run.rests_on);
}

const answer = h("p.note", { role: "status" });
const question = h("button.quiet", { type: "button", title: "Plan by the weights in force, and compare the way to the nearest known floor of a favoured label", onclick: explain }, "Why not to a favoured label first?");

/** Stands below what the plan leads to. */
export const whyPart = h("div", { hidden: true }, question, answer);

async function explain() {
  const { vehicle } = store;
  try {
    text(answer, (await dryRun(vehicle.id, weightsInForce(vehicle))).text);
  } catch (error) {
    text(answer, error.message);
  }
}

/** Asks and answers only while the plan leads elsewhere than to a favoured label. */
export function refreshWhy(vehicle) {
  const isElsewhere = Boolean(vehicle.aims?.first) && vehicle.aims.first.reason !== "label";
  show(whyPart, isElsewhere && !store.replay && vehicle.labels.some((label) => label.weight > 0));
  if (whyPart.hidden) text(answer, "");
}
