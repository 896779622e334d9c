// The life line of something sent to the vehicle: queued, on air, heard, applied or refused.

import { announce, h, show, text } from "../dom.js";
import { span } from "../format.js";
import { ageOf } from "../store.js";

const STEPS = ["queued", "on_air", "heard", "applied"];
const WORDS = { queued: "Queued", on_air: "On air", heard: "Heard", applied: "Applied", refused: "Refused" };

export const word = (state) => WORDS[state] ?? state;

/** A stepper; call its `update(slot | null, waiting)` with a slot of the server's directive. */
export function lifeline(name) {
  const steps = STEPS.map((s) => h("li", { data: { step: s } }, WORDS[s]));
  const list = h("ol.steps", { "aria-label": `Life line: ${name}` }, ...steps);
  const note = h("p.note");
  let announced = null;
  const node = h("div.lifeline", {}, list, note);

  function update(slot, waiting = null) {
    show(list, slot !== null);
    const said = slot && `${name}: ${word(slot.state)}`;
    if (announced !== null && said !== announced) announce(said);
    announced = said;
    node.dataset.state = slot?.state ?? "none";
    if (slot) mark(steps, slot);
    text(note, waiting ?? describe(slot));
  }
  return { node, update };
}

function mark(steps, slot) {
  const refused = slot.state === "refused";
  const reached = refused ? STEPS.length - 1 : STEPS.indexOf(slot.state);
  steps.forEach((step, i) => {
    const last = i === STEPS.length - 1;
    step.className = i < reached ? "done" : i > reached ? "" : refused ? "refused" : last ? "done now" : "now";
    if (i === reached) step.setAttribute("aria-current", "step");
    else step.removeAttribute("aria-current");
    if (last) text(step, refused ? WORDS.refused : WORDS.applied);
  });
}

export function describe(slot) {
  if (!slot) return "Nothing sent yet.";
  const since = span(ageOf(slot.changed_s));
  const took = span(slot.changed_s - slot.issued_s);
  const version = `Version ${slot.version}`;
  switch (slot.state) {
    case "queued": return `${version} waits for the surface's turn, ${since}.`;
    case "on_air": return `${version} was sent; not confirmed by the vehicle yet, ${since}.`;
    case "heard": return `${version} reached the vehicle; not applied yet, ${since}.`;
    case "applied": return `${version} applied ${since} ago, ${took} after it was issued.`;
    case "refused": return `${version} refused ${since} ago: ${slot.reason ?? "no reason given"}.`;
    default: return `${version}: ${slot.state}.`;
  }
}

export const slotOf = (vehicle, name) => vehicle?.directive.slots.find((s) => s.slot === name) ?? null;
