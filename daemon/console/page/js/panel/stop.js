// Hold, resume and abort: each needs a second, deliberate action.

import { sendConstraints } from "../api.js";
import { denial } from "../command.js";
import { $, fill, h, show, text } from "../dom.js";
import { SentVersions, replacedNote } from "../order/sent-versions.js";
import { orderStatus, slotOf } from "../order/status.js";
import { store } from "../store.js";
import { contact, isHolding, isStopped } from "./banners.js";

const ORDERS = {
  hold: { button: "Hold", question: (v) => `Hold ${v.name} where it is?`, action: "hold" },
  resume: { button: "Resume", question: (v) => `Let ${v.name} resume its survey?`, action: "resume" },
  abort: { button: "Abort", question: (v) => `Abort the mission of ${v.name}?`, action: "abort", grave: true },
};

const sentVersions = new SentVersions("constraints");
const replaced = replacedNote(sentVersions, "Hold");
const status = orderStatus("Hold, resume or abort");
const deniedLine = h("p.note.denied");
const errorLine = h("p.error", { role: "alert" });
const hold = h("button", { type: "button", id: "hold", onclick: () => confirm(isHolding(store.vehicle) ? ORDERS.resume : ORDERS.hold) });
const resume = h("button", { type: "button", id: "resume", onclick: () => confirm(ORDERS.resume) }, "Resume survey");
const abort = h("button.grave", { type: "button", id: "abort", onclick: () => confirm(ORDERS.abort) }, "Abort mission");

/** The same orders in the bar, which is on every page and comes first in the order of the keyboard. */
const barHold = h("button", { type: "button", id: "bar-hold", "aria-haspopup": "dialog", "aria-keyshortcuts": "Shift+H", onclick: () => hold.click() });
const barAbort = h("button.grave", { type: "button", id: "bar-abort", "aria-haspopup": "dialog", "aria-keyshortcuts": "Shift+A", onclick: () => abort.click() }, "Abort");

const HELP = new Map([[barHold, "Asks first; the keys are Shift+H"], [barAbort, "Asks first; the keys are Shift+A"]]);

export function startStop() {
  $("stop").append(barHold, barAbort);
  addEventListener("keydown", (event) => {
    const button = { H: barHold, A: barAbort }[event.key];
    const isTyping = event.target.closest?.("input:not([type=range]):not([type=checkbox]), select, textarea");
    if (!button || !event.shiftKey || event.ctrlKey || event.altKey || event.metaKey || isTyping || $("dialog").open) return;
    event.preventDefault();
    button.click();
  });
}

export const stopParts = [h("div.buttons", {}, hold, resume, abort), deniedLine, errorLine, replaced.node, status.node];

export function refreshStop(v) {
  text(hold, isHolding(v) ? "Resume survey" : "Hold position");
  show(resume, isStopped(v));
  const [stop, order] = [denial("stop"), denial("order")];
  text(barHold, isHolding(v) ? "Resume" : "Hold");
  barHold.setAttribute("aria-label", `${barHold.textContent} ${v.name}`);
  barAbort.setAttribute("aria-label", `Abort ${v.name}`);
  const held = isHolding(v) ? order : stop;
  for (const [b, denied] of [[hold, held], [barHold, held], [resume, order], [abort, stop], [barAbort, stop]]) {
    b.disabled = !store.connected || denied !== null;
    b.title = denied ?? HELP.get(b) ?? "";
  }
  const reason = stop ?? (isHolding(v) || isStopped(v) ? order : null);
  show(deniedLine, reason !== null);
  text(deniedLine, reason ?? "");
  const slot = slotOf(v, "constraints");
  replaced.update(v);
  show(status.node, slot !== null);
  status.update(slot);
}

function confirm(order) {
  const v = store.vehicle;
  const dialog = $("dialog");
  const go = h("button.primary", { type: "button", disabled: Boolean(order.grave), onclick: () => (send(v, order), dialog.close()) }, order.button);
  const sure = h("input", { type: "checkbox", onchange: () => (go.disabled = !sure.checked) });
  const reaction = v.limits?.on_abort ?? "the vehicle's default";
  fill(dialog,
    h("h2", { id: "dialog-title" }, order.question(v)),
    order.grave ? h("p", {}, `The survey ends. Reaction on abort: ${reaction}.`) : null,
    h("p", {}, `The surface sends the order in its next turn. ${contact(v)}`),
    order.grave ? h("label.sure", {}, sure, `Yes, abort ${v.name}`) : null,
    h("div.buttons", {}, h("button", { type: "button", onclick: () => dialog.close() }, "Cancel"), go),
  );
  dialog.showModal();
}

async function send(v, order) {
  text(errorLine, "");
  try {
    sentVersions.add(v, (await sendConstraints(v.id, { action: order.action })).version);
  } catch (error) {
    text(errorLine, error.message);
  }
}
