// An order that fills one slot of the directive: the operator's edit, the value at the server, sending, and the reply.
//
// An order has parts that are edited one by one, such as the weight of each label. An order that is edited as a whole has the
// single part WHOLE.

import { missionKey, store } from "../store.js";
import { SentVersions } from "./sent-versions.js";

const WHOLE = "whole";
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

export class Order {
  #edits = new Map();

  /** `read(vehicle, part)` is the server's value; `post(vehicle, value)` sends and resolves to {version}; `value(part)` gives what to send. */
  constructor(slot, read, post, sentVersions = new SentVersions(slot)) {
    Object.assign(this, { slot, read, post, sentVersions });
  }

  /** `parts`: part -> {value, base, version}; `base` is the value that the edit began with, `version` the one that carries it. */
  #edit(vehicle) {
    const key = missionKey(vehicle);
    if (!this.#edits.has(key)) this.#edits.set(key, { parts: new Map(), version: null, busy: false, error: null });
    return this.#edits.get(key);
  }

  #isInFlight(vehicle) {
    const { version } = this.#edit(vehicle);
    return version !== null && !this.sentVersions.hasArrived(vehicle, version);
  }

  value(vehicle, part = WHOLE) {
    const edited = this.#edit(vehicle).parts.get(part);
    return edited ? edited.value : this.read(vehicle, part);
  }

  /** The parts with an edit that is not sent. */
  unsent(vehicle) {
    return [...this.#edit(vehicle).parts].filter(([, p]) => p.version === null).map(([part]) => part);
  }

  /** Whether there is an edit that is not sent: of `part`, or of any. */
  isChanged(vehicle, part = null) {
    const unsent = this.unsent(vehicle);
    return part === null ? unsent.length > 0 : unsent.includes(part);
  }

  set(vehicle, value, part = WHOLE) {
    // A record shows the orders of its moment, which an edit would hide.
    if (store.replay) return;
    const edit = this.#edit(vehicle);
    const before = edit.parts.get(part);
    const isSent = Boolean(before) && before.version !== null;
    // A further edit begins with the value that is on its way to the server.
    const base = !before ? this.read(vehicle, part) : isSent ? before.value : before.base;
    if (!isSent && same(value, this.read(vehicle, part))) edit.parts.delete(part);
    else edit.parts.set(part, { value, base, version: null });
    edit.error = null;
    store.emit("edit");
  }

  /** Takes the edit of one part back. */
  undo(vehicle, part) {
    this.#edit(vehicle).parts.delete(part);
    store.emit("edit");
  }

  discard(vehicle) {
    this.#edit(vehicle).error = null;
    this.revert(vehicle);
  }

  /** Drops the edit and keeps the server's error message. */
  revert(vehicle) {
    this.#edit(vehicle).parts.clear();
    store.emit("edit");
  }

  /** Whether another console changed the server's value after the edit of `part` began. */
  isConflicting(vehicle, part) {
    const edited = this.#edit(vehicle).parts.get(part);
    return Boolean(edited) && edited.version === null && !this.#isInFlight(vehicle) && !same(this.read(vehicle, part), edited.base);
  }

  hasConflict(vehicle) {
    return this.unsent(vehicle).some((part) => this.isConflicting(vehicle, part));
  }

  /** Resolves to true if the server accepted the order. */
  async send(vehicle) {
    const edit = this.#edit(vehicle);
    const sending = new Map(edit.parts);
    Object.assign(edit, { busy: true, error: null });
    store.emit("edit");
    try {
      const accepted = await this.post(vehicle, (part = WHOLE) => (sending.has(part) ? sending.get(part).value : this.read(vehicle, part)));
      // An order to all vehicles has a version for each.
      const version = accepted.version ?? accepted.versions?.[vehicle.id];
      if (version !== undefined) this.sentVersions.add(vehicle, version);
      edit.version = version;
      for (const [part, sent] of sending) {
        if (version === undefined) {
          // The surface alone obeys it, so there is no order to wait for.
          if (edit.parts.get(part) === sent) edit.parts.delete(part);
          continue;
        }
        sent.version = version;
        const now = edit.parts.get(part);
        // The operator continued to edit while the order was on its way.
        if (now && now !== sent) now.base = sent.value;
      }
    } catch (error) {
      edit.error = error.message;
    }
    edit.busy = false;
    store.emit("edit");
    return edit.error === null;
  }

  /** Drops edits that have arrived in the server's state; then {busy, error, waiting}: texts or null. */
  progress(vehicle) {
    const edit = this.#edit(vehicle);
    for (const [part, { version }] of edit.parts) {
      if (version !== null && this.sentVersions.hasArrived(vehicle, version)) edit.parts.delete(part);
    }
    const accepted = [...edit.parts.values()].find((p) => p.version !== null);
    const waiting = edit.busy ? "Sending to scenecast." : accepted ? `Version ${accepted.version} was accepted by the surface; no report yet.` : null;
    return { busy: edit.busy, error: edit.error, waiting };
  }
}
