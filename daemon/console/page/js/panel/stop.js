// Hold, resume and abort: one byte to the vehicle, each confirmed by a second, deliberate action.

import { sendConstraints } from "../api.js";
import { $, h, show, text } from "../dom.js";
import { store } from "../store.js";
import { contact } from "./banners.js";
import { lifeline, slotOf } from "./lifeline.js";
import { Ours, othersNote } from "./ours.js";

const ORDERS = {
  hold: { button: "Hold", ask: (v) => `Hold ${v.name} where it is?`, body: { hold: true } },
  resume: { button: "Resume", ask: (v) => `Let ${v.name} resume its survey?`, body: { hold: false } },
  abort: { button: "Abort", ask: (v) => `Abort the mission of ${v.name}?`, body: { hold: false, abort: true }, grave: true },
};
const STOPPED = ["return", "surface", "abort"];

const ours = new Ours("constraints");
const others = othersNote(ours, "Hold");
const line = lifeline("Hold and abort");
const error = h("p.error", { role: "alert" });
const hold = h("button", { type: "button", id: "hold", onclick: () => confirm(holding(store.vehicle) ? ORDERS.resume : ORDERS.hold) });
const resume = h("button", { type: "button", id: "resume", onclick: () => confirm(ORDERS.resume) }, "Resume survey");
const abort = h("button.grave", { type: "button", id: "abort", onclick: () => confirm(ORDERS.abort) }, "Abort mission");

export const stopParts = [h("div.buttons", {}, hold, resume, abort), error, others.node, line.node];

const holding = (v) => v.status?.mode === "hold";

export function refreshStop(v) {
  text(hold, holding(v) ? "Resume survey" : "Hold position");
  show(resume, STOPPED.includes(v.status?.mode));
  for (const b of [hold, resume, abort]) b.disabled = !store.connected;
  const slot = slotOf(v, "constraints");
  others.update(v);
  show(line.node, slot !== null);
  line.update(slot);
}

function confirm(order) {
  const v = store.vehicle;
  const dialog = $("dialog");
  const go = h("button.primary", { type: "button", disabled: Boolean(order.grave), onclick: () => (send(v, order), dialog.close()) }, order.button);
  const sure = h("input", { type: "checkbox", onchange: () => (go.disabled = !sure.checked) });
  const then = v.limits?.on_abort ?? "as configured on the vehicle";
  dialog.replaceChildren(
    h("h2", { id: "dialog-title" }, order.ask(v)),
    order.grave ? h("p", {}, `The survey ends. On abort it is to: ${then}.`) : null,
    h("p", {}, `The order goes out with the surface's next turn. ${contact(v)}`),
    order.grave ? h("label.sure", {}, sure, `Yes, abort ${v.name}`) : null,
    h("div.buttons", {}, h("button", { type: "button", onclick: () => dialog.close() }, "Cancel"), go),
  );
  dialog.showModal();
}

async function send(v, order) {
  text(error, "");
  try {
    ours.sent(v, (await sendConstraints(v.id, order.body)).version);
  } catch (problem) {
    text(error, problem.message);
  }
}
