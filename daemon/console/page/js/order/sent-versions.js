// Which version of a slot this page sent last, and whether another console has sent a later one. Several consoles may give
// orders; the last one wins.

import { h, show, text } from "../dom.js";
import { missionKey, store } from "../store.js";
import { slotOf } from "./status.js";

export class SentVersions {
  #sent = new Map();

  constructor(slot) {
    this.slot = slot;
  }

  /** The server accepted this page's order as `version`. */
  add(vehicle, version) {
    this.#sent.set(missionKey(vehicle), { version, seen: false });
  }

  forget(vehicle) {
    this.#sent.delete(missionKey(vehicle));
  }

  /** Whether the server's state contains our order or a later one. A restarted surface counts from 1 again, hence `seen`. */
  hasArrived(vehicle, version) {
    const now = slotOf(vehicle, this.slot)?.version ?? null;
    const ours = this.#sent.get(missionKey(vehicle));
    if (ours && ours.version === now) ours.seen = true;
    return now !== null && (now >= version || Boolean(ours?.seen));
  }

  /** The version of another console that replaced ours, or null. */
  replacedBy(vehicle) {
    const ours = this.#sent.get(missionKey(vehicle));
    if (!ours) return null;
    const now = slotOf(vehicle, this.slot)?.version ?? null;
    if (now === ours.version) ours.seen = true;
    return now !== null && now !== ours.version && (ours.seen || now > ours.version) ? now : null;
  }
}

/** The note that another console replaced our order. `update(vehicle, conflict)`: `conflict` is a text about an edit that is not sent yet, or null. */
export function replacedNote(sentVersions, name) {
  const message = h("span");
  const accept = () => {
    sentVersions.forget(store.vehicle);
    store.emit("edit");
  };
  const ok = h("button.undo", { type: "button", onclick: accept }, "OK");
  ok.setAttribute("aria-label", `OK: ${name} changed by another console`);
  const node = h("p.replaced", { role: "status" }, message, " ", ok);
  const update = (vehicle, conflict = null) => {
    const version = sentVersions.replacedBy(vehicle);
    show(node, version !== null || conflict !== null);
    show(ok, conflict === null);
    if (conflict !== null) text(message, conflict);
    else if (version !== null) text(message, `Changed by another console (version ${version}) after your order.`);
  };
  return { node, update };
}
