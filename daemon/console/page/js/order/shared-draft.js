// The edit of an order that the surface keeps, so that the pages of all operators show it, and this one after a reload.

import { denial } from "../command.js";
import { missionKey, store } from "../store.js";

/** A run of moves of a slider is one message. */
const PAUSE_MS = 400;

export class SharedDraft {
  /** By vehicle: the draft that this page last sent or received, as a text, and its number at the surface. */
  #held = new Map();
  #isAdopting = false;

  /** `read(vehicle)` gives the draft at the surface: {number, parts}, `parts` being [[part, value], ..]; `write(vehicle, parts)` replaces it. */
  constructor(order, read, write) {
    Object.assign(this, { order, read, write });
  }

  start() {
    store.on("edit", () => this.#follow());
    store.on("state select", () => this.#adopt());
    addEventListener("pagehide", () => this.#flush());
  }

  #of(vehicle) {
    const key = missionKey(vehicle);
    if (!this.#held.has(key)) this.#held.set(key, { vehicle, text: "[]", number: 0, least: 0, timer: null, busy: false });
    return this.#held.get(key);
  }

  #parts(vehicle) {
    return this.order.unsent(vehicle).map((part) => [part, this.order.value(vehicle, part)]);
  }

  /** Sends the operator's edit after a pause. */
  #follow() {
    const { vehicle } = store;
    if (!vehicle || this.#isAdopting || denial("record") !== null) return;
    const held = this.#of(vehicle);
    const text = asText(this.#parts(vehicle));
    if (text === held.text) return;
    Object.assign(held, { vehicle, text });
    clearTimeout(held.timer);
    held.timer = setTimeout(() => this.#send(held), PAUSE_MS);
  }

  async #send(held) {
    clearTimeout(held.timer);
    Object.assign(held, { timer: null, busy: true });
    try {
      await this.write(held.vehicle, JSON.parse(held.text));
      held.least = held.number + 1;
    } catch {
      // The draft stays on this page alone; the next edit is sent again.
    }
    held.busy = false;
  }

  #flush() {
    for (const held of this.#held.values()) if (held.timer !== null) this.#send(held);
  }

  /** Takes the draft of the surface, unless an edit of this page is on its way there. */
  #adopt() {
    const { vehicle } = store;
    if (!vehicle || store.replay) return;
    const held = this.#of(vehicle);
    const { number, parts } = this.read(vehicle);
    if (held.timer !== null || held.busy || number === held.number || number < held.least) return;
    held.number = number;
    const text = asText(parts);
    if (text === held.text) return;
    held.text = text;
    this.#isAdopting = true;
    const wanted = new Map(parts);
    for (const part of this.order.unsent(vehicle)) if (!wanted.has(part)) this.order.undo(vehicle, part);
    for (const [part, value] of wanted) this.order.set(vehicle, value, part);
    this.#isAdopting = false;
  }
}

const asText = (parts) => JSON.stringify([...parts].sort(([a], [b]) => String(a).localeCompare(String(b))));
