// The foot of an order in a panel: send, discard, error, changes by other consoles, order status.

import { denial } from "../command.js";
import { h, show, text } from "../dom.js";
import { store } from "../store.js";
import { replacedNote } from "./sent-versions.js";
import { isVoid, orderStatus, slotOf } from "./status.js";

const CONFLICT = "Changed by another console meanwhile: Send replaces that change, Discard accepts it.";

/** `update(vehicle, isFaulty)` refreshes it. `caption(unsent)` is the text on the button, `unsent` the number of edited parts. */
export function orderFoot(order, name, id, caption = () => `Send ${name.toLowerCase()}`) {
  const send = h("button.primary", { type: "button", id, onclick: () => order.send(store.vehicle) }, caption(0));
  const discard = h("button", { type: "button", onclick: () => order.discard(store.vehicle) }, "Discard");
  discard.setAttribute("aria-label", `Discard ${name.toLowerCase()} edits`);
  const errorLine = h("p.error", { role: "alert" });
  const deniedLine = h("p.note.denied");
  const replaced = replacedNote(order.sentVersions, name);
  const status = orderStatus(name);
  const node = h("div.order", {}, h("div.buttons", {}, send, discard), deniedLine, errorLine, replaced.node, status.node);

  function update(vehicle, isFaulty = false) {
    const { busy, error, waiting } = order.progress(vehicle);
    const slot = slotOf(vehicle, order.slot);
    const unsent = order.unsent(vehicle).length;
    const again = isVoid(slot) && unsent === 0;
    const denied = denial(order.slot === "settings" ? "settings" : "order");
    send.disabled = busy || denied !== null || isFaulty || !store.connected || (unsent === 0 && !again);
    text(send, again ? `Send ${name.toLowerCase()} again` : caption(unsent));
    show(deniedLine, denied !== null);
    text(deniedLine, denied ?? "");
    show(discard, unsent > 0);
    show(errorLine, error !== null);
    text(errorLine, error ?? "");
    replaced.update(vehicle, order.hasConflict(vehicle) ? CONFLICT : null);
    status.update(slot, waiting);
  }
  return { node, update };
}
