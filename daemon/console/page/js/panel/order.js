// One order that replaces a slot as a whole: the edit here, what the server has, sending, and what became of it.

import { h, show, text } from "../dom.js";
import { store } from "../store.js";
import { lifeline, slotOf } from "./lifeline.js";
import { Ours, othersNote } from "./ours.js";

export class Order {
  #edits = new Map();

  /** `read(vehicle)` is the value that was sent last; `post(vehicle, value)` sends another and answers {version}. */
  constructor(slot, read, post) {
    Object.assign(this, { slot, read, post, ours: new Ours(slot) });
  }

  #edit(vehicle) {
    const { mission } = store.snapshot;
    const key = `${mission.id ?? mission.name}.${vehicle.id}`;
    if (!this.#edits.has(key)) this.#edits.set(key, { value: null, base: null, version: null, last: null, busy: false, error: null });
    return this.#edits.get(key);
  }

  value(vehicle) {
    return this.#edit(vehicle).value ?? this.read(vehicle);
  }

  /** Whether there is an edit that was not sent. */
  changed(vehicle) {
    const e = this.#edit(vehicle);
    return e.value !== null && e.version === null;
  }

  set(vehicle, value) {
    const e = this.#edit(vehicle);
    // What is on its way to the server is what a further edit starts from.
    if (e.version !== null) e.base = JSON.stringify(e.value);
    else if (e.value === null) e.base = JSON.stringify(this.read(vehicle));
    const same = JSON.stringify(value) === JSON.stringify(this.read(vehicle)) && e.version === null;
    Object.assign(e, { value: same ? null : value, version: null, error: null });
    store.tell("draft");
  }

  discard(vehicle) {
    Object.assign(this.#edit(vehicle), { value: null, version: null, error: null });
    store.tell("draft");
  }

  /** Whether another console changed under our edit what it started from. */
  changedElsewhere(vehicle) {
    const { base, last } = this.#edit(vehicle);
    const ours = last !== null && !this.ours.arrived(vehicle, last);
    return this.changed(vehicle) && !ours && JSON.stringify(this.read(vehicle)) !== base;
  }

  /** Drops a refused edit, and keeps the words of the refusal. */
  revert(vehicle) {
    Object.assign(this.#edit(vehicle), { value: null, version: null });
    store.tell("draft");
  }

  /** True if scenecast took it. */
  async send(vehicle) {
    const e = this.#edit(vehicle);
    const value = this.value(vehicle);
    Object.assign(e, { busy: true, error: null });
    store.tell("draft");
    try {
      const { version } = await this.post(vehicle, value);
      this.ours.sent(vehicle, version);
      e.last = version;
      if (e.value === value) e.version = version;
      else e.base = JSON.stringify(value);
    } catch (error) {
      e.error = error.message;
    }
    e.busy = false;
    store.tell("draft");
    return e.error === null;
  }

  /** Drops an edit once the server's state carries it; returns what the page knows of the way there. */
  settle(vehicle) {
    const e = this.#edit(vehicle);
    if (e.version !== null && this.ours.arrived(vehicle, e.version)) Object.assign(e, { value: null, version: null });
    const handed = e.version !== null ? `Version ${e.version} handed over; no report yet.` : null;
    return { busy: e.busy, error: e.error, waiting: e.busy ? "Handing over to scenecast." : handed };
  }
}

/** Send, discard, refusal, other consoles and life line of `order`; `update(vehicle, faulty)`. */
export function orderFoot(order, name, id) {
  const send = h("button.primary", { type: "button", id, onclick: () => order.send(store.vehicle) }, `Send ${name.toLowerCase()}`);
  const drop = h("button", { type: "button", onclick: () => order.discard(store.vehicle) }, "Discard");
  drop.setAttribute("aria-label", `Discard ${name.toLowerCase()} edits`);
  const error = h("p.error", { role: "alert" });
  const others = othersNote(order.ours, name);
  const line = lifeline(name);
  const node = h("div.order", {}, h("div.buttons", {}, send, drop), error, others.node, line.node);

  function update(vehicle, faulty = false) {
    const { busy, error: problem, waiting } = order.settle(vehicle);
    const slot = slotOf(vehicle, order.slot);
    const changed = order.changed(vehicle);
    const again = slot?.state === "refused" && !changed;
    send.disabled = busy || faulty || !store.connected || (!changed && !again);
    text(send, again ? `Send ${name.toLowerCase()} again` : `Send ${name.toLowerCase()}`);
    show(drop, changed);
    show(error, problem !== null);
    text(error, problem ?? "");
    others.update(vehicle, order.changedElsewhere(vehicle) ? "Changed by another console meanwhile; sending replaces it, Discard takes it over." : null);
    line.update(slot, waiting);
  }
  return { node, update };
}
