// The order status of the directive slots: queued -> on_air -> received -> applied | refused, or withdrawn.

const SLOTS = ["utility", "constraints", "settings", "budget", "requests", "fix", "limits", "fence", "destination", "areas"];
const REASONS = {
  utility: "label 3 was retired under epoch 1",
  constraints: "holding here would break the return margin",
  fence: "the vehicle is outside of it",
  limits: "depth_m: the vehicle flies at 16.4 m",
  settings: "a value is outside what the vehicle accepts",
  budget: "below the 500 bit/s that status needs",
  destination: "it contradicts itself or a constraint in force",
  requests: "no image kept for this label",
};

export class Directive {
  constructor() {
    this.slots = new Map();
    this.refuseNext = new Set();
  }

  issue(slot, nowS, onApplied, name = slot) {
    const version = (this.slots.get(slot)?.version ?? 0) + 1;
    const made = { slot, name, version, state: "queued", reason: null, issued_s: nowS, changed_s: nowS, onApplied };
    this.slots.set(slot, made);
    return { slot, name, version };
  }

  /** The surface's turn: whatever is queued goes on air. */
  transmit(nowS) {
    for (const s of this.slots.values()) if (s.state === "queued") this.move(s, "on_air", nowS);
  }

  /** The downlink turn arrived (or not) at the vehicle. */
  deliver(nowS, arrived) {
    for (const s of this.slots.values()) {
      if (s.state === "on_air") s.arrived = arrived;
      if (s.state === "on_air" && !arrived) this.move(s, "queued", nowS);
    }
  }

  /** A frame from the vehicle came back with its acks. */
  acknowledge(nowS) {
    for (const s of this.slots.values()) {
      if (s.state === "received") this.finish(s, nowS);
      else if (s.state === "on_air" && s.arrived) this.move(s, "received", nowS);
    }
  }

  finish(s, nowS) {
    if (this.refuseNext.delete(s.slot)) {
      s.reason = REASONS[s.slot] ?? "not possible now";
      this.move(s, "refused", nowS);
    } else {
      this.move(s, "applied", nowS);
    }
    s.onApplied?.(s.state);
  }

  /** The surface sends an order no more, unless an operator wishes it. */
  withdraw(slot, reason, nowS) {
    const s = this.slots.get(slot);
    Object.assign(s, { reason, asks: true });
    this.move(s, "withdrawn", nowS);
  }

  /** The withdrawn order of a slot goes out again, as a new one. */
  again(slot, nowS) {
    const { name, onApplied } = this.slots.get(slot);
    return this.issue(slot, nowS, onApplied, name);
  }

  move(s, state, nowS) {
    s.state = state;
    s.changed_s = nowS;
  }

  json() {
    const known = SLOTS.map((name) => this.slots.get(name)).filter(Boolean);
    return { slots: known.map(({ onApplied, arrived, ...shown }) => shown) };
  }
}
