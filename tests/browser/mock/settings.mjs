// Settings of the scene model: requested, in force, and those that fit a budget.

const NUMBERS = {
  labels: [2, 32], alpha: [1e-9, 1e3], beta: [1e-9, 1e3], gamma: [1e-12, 1e3], refine_words_per_s: [1, 1e8], frames_per_s: [0.01, 30],
};
const KEYS = ["planner", "at_end", "registration", "cells", "layers", ...Object.keys(NUMBERS)];
const nothing = () => Object.fromEntries(KEYS.map((k) => [k, null]));
const stated = (order) => Object.fromEntries(Object.entries(order).filter(([k, v]) => KEYS.includes(k) && v !== null));

export class Settings {
  requested = nothing();
  inForce = nothing();

  request(order, last) {
    this.requested = { ...(last === "refused" ? this.inForce : this.requested), ...stated(order) };
  }

  finish(state) {
    if (state === "applied") this.inForce = this.requested;
  }

  json() {
    return { requested: this.requested, in_force: this.inForce };
  }
}

export function faultOf(order) {
  for (const [key, [low, high]] of Object.entries(NUMBERS)) {
    const value = order[key] ?? 0;
    if (value !== 0 && !(value >= low && value <= high)) return `${key} ${value}: the range is ${low} to ${high}, or 0 for the vehicle's default`;
  }
  return null;
}

const row = (settings, nats, labels, bps) => ({
  settings: { ...nothing(), ...settings }, mutual_information_nats: nats, lost_nats: 0.31 - nats, labels, stream_bps: bps,
});
const BEST = row({ labels: 16, frames_per_s: 0.5, cells: "fine" }, 0.31, 16, 1900);
const FEWER = row({ labels: 9, frames_per_s: 0.2, cells: "fine" }, 0.29, 9, 800);
const LOWEST_RATE = row({ labels: 9, frames_per_s: 0.2, cells: "coarse" }, 0.2, 9, 90);

export function fit(bitsPerS, mission) {
  const bps = bitsPerS === null ? (mission.budgetBps * mission.shares.map) / 100 : Number(bitsPerS);
  const chosen = [BEST, FEWER, LOWEST_RATE].find((r) => r.stream_bps <= bps) ?? null;
  const tradeOff = chosen === null ? `no setting fits ${bps} bit/s: the lowest rate is 90 bit/s, 0.11 nats (35 %) below the best`
    : chosen === BEST ? "no trade-off: these are the most informative settings"
      : chosen === FEWER ? "fewer labels, fewer camera frames: 0.02 nats (6 %) below the best, which needs 1.9 kbit/s"
        : "coarser cells, fewer labels: 0.11 nats (35 %) below the best, which needs 1.9 kbit/s";
  return { bits_per_s: bps, chosen, best: BEST, lowest_rate: LOWEST_RATE, trade_off: tradeOff };
}
