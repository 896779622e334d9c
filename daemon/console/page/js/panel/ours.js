// Whether the last word on a slot is ours: several consoles may steer, and the last edit wins.

import { h, show, text } from "../dom.js";
import { store } from "../store.js";
import { slotOf } from "./lifeline.js";

export class Ours {
  #sent = new Map();

  constructor(slot) {
    this.slot = slot;
  }

  #key(vehicle) {
    const { mission } = store.snapshot;
    return `${mission.id ?? mission.name}.${vehicle.id}`;
  }

  /** This page's order was taken as `version`. */
  sent(vehicle, version) {
    this.#sent.set(this.#key(vehicle), { version, seen: false });
  }

  forget(vehicle) {
    this.#sent.delete(this.#key(vehicle));
  }

  /** Whether the server's state has our order, or one after it. Versions may begin anew, hence `seen`. */
  arrived(vehicle, version) {
    const now = slotOf(vehicle, this.slot)?.version ?? null;
    const mine = this.#sent.get(this.#key(vehicle));
    if (mine && mine.version === now) mine.seen = true;
    return now !== null && (now >= version || Boolean(mine?.seen));
  }

  /** The version of another console that came after ours, or null. */
  overtaken(vehicle) {
    const mine = this.#sent.get(this.#key(vehicle));
    if (!mine) return null;
    const now = slotOf(vehicle, this.slot)?.version ?? null;
    if (now === mine.version) mine.seen = true;
    return now !== null && now !== mine.version && (mine.seen || now > mine.version) ? now : null;
  }
}

/** The line that says so; `update(vehicle, over)`, `over` being words for a draft that was overtaken, or null. */
export function othersNote(ours, name) {
  const words = h("span");
  const seen = h("button.undo", { type: "button", onclick: () => (ours.forget(store.vehicle), store.tell("draft")) }, "OK");
  seen.setAttribute("aria-label", `OK: ${name} changed by another console`);
  const node = h("p.others", { role: "status" }, words, " ", seen);
  const update = (vehicle, over = null) => {
    const version = ours.overtaken(vehicle);
    show(node, version !== null || over !== null);
    show(seen, over === null);
    if (over !== null) text(words, over);
    else if (version !== null) text(words, `Changed by another console (version ${version}) since you sent yours.`);
  };
  return { node, update };
}
