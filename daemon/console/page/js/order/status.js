// The status of an order to the vehicle: queued, on air, received, applied, refused or withdrawn.

import { announce, h, show, text } from "../dom.js";
import { span } from "../format.js";
import { ageOf, store } from "../store.js";

const STEPS = ["queued", "on_air", "received", "applied"];
const NAMES = { queued: "Queued", on_air: "On air", received: "Received", applied: "Applied", refused: "Refused", withdrawn: "Withdrawn" };

export const nameOfStatus = (state) => NAMES[state] ?? state;
/** Whether the vehicle will not obey it, so that it can be sent again. */
export const isVoid = (slot) => ["refused", "withdrawn"].includes(slot?.state);

/** A row of steps. `update(slot, waiting)` takes a slot of the server's directive or null, and a text that replaces its description. */
export function orderStatus(name) {
  const steps = STEPS.map((s) => h("li", { data: { step: s } }, NAMES[s]));
  const list = h("ol.steps", { "aria-label": `Order status: ${name}` }, ...steps);
  const note = h("p.note");
  let announced = null;
  const node = h("div.order-status", {}, list, note);

  function update(slot, waiting = null) {
    show(list, slot !== null);
    const status = slot && `${name}: ${nameOfStatus(slot.state)}`;
    if (announced !== null && status !== announced && !store.replay) announce(status);
    announced = status;
    node.dataset.state = slot?.state ?? "none";
    if (slot) mark(steps, slot);
    text(note, waiting ?? describe(slot));
  }
  return { node, update };
}

function mark(steps, slot) {
  const refused = isVoid(slot);
  const reached = refused ? STEPS.length - 1 : STEPS.indexOf(slot.state);
  steps.forEach((step, i) => {
    const last = i === STEPS.length - 1;
    step.className = i < reached ? "done" : i > reached ? "" : refused ? "refused" : last ? "done now" : "now";
    if (i === reached) step.setAttribute("aria-current", "step");
    else step.removeAttribute("aria-current");
    if (last) text(step, refused ? NAMES[slot.state] : NAMES.applied);
  });
}

export function describe(slot) {
  if (!slot) return "No order sent yet.";
  const since = span(ageOf(slot.changed_s));
  const took = span(slot.changed_s - slot.issued_s);
  const version = `Version ${slot.version}`;
  switch (slot.state) {
    case "queued": return `${version} has waited ${since} for the surface's turn.`;
    case "on_air": return `${version} was sent ${since} ago; the vehicle has not confirmed it yet.`;
    case "received": return `${version} reached the vehicle ${since} ago; it is not applied yet.`;
    case "applied": return `${version} was applied ${since} ago, ${took} after it was issued.`;
    case "refused": return `${version} was refused ${since} ago: ${slot.reason ?? "no reason given"}.`;
    case "withdrawn": return `${version} was withdrawn ${since} ago: ${slot.reason}${slot.reason?.endsWith("?") ? "" : "."}`;
    default: return `${version}: ${slot.state}.`;
  }
}

export const slotOf = (vehicle, name) => vehicle?.directive.slots.find((s) => s.slot === name) ?? null;
