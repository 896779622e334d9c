// The whole synthetic mission: vehicles, the surface's turns, budget and the state document.

import { Command } from "./command.mjs";
import { LAYERS, Vehicle } from "./vehicle.mjs";
import { Direction } from "./link.mjs";
import { TRUTH } from "./truth.mjs";

export const SCENARIOS = {
  empty: { advance: 0 },
  start: { advance: 30 },
  rich: { advance: 330 },
  silent: { advance: 330, silent: true, after: 58 },
  refused: { advance: 330, refuse: true },
  two: { advance: 300, vehicles: 2 },
  big: { advance: 1600, vehicle: { legs: { width: 128, height: 126, x: -64, y: -64 }, speed: 18, footprint: 4 } },
  wide: { advance: 120, wide: true },
};

export class Mission {
  constructor(name = "rich") {
    const plan = SCENARIOS[name] ?? SCENARIOS.rich;
    this.name = name;
    this.nowS = 0;
    this.speed = 1;
    this.loss = 0.1;
    this.budgetBps = 10000;
    this.shares = { directive: 10, status: 5, fix: 5, map: 50, exemplar: 20 };
    this.background = ["finer", "depth", "exemplars", "confidence", "floor"];
    this.layers = false;
    this.ended = false;
    this.truth = false;
    this.command = new Command();
    this.log = [];
    this.down = new Direction(7);
    this.history = [];
    this.nextDownS = 2;
    this.deliverS = null;
    this.vehicles = [new Vehicle(1, plan.vehicle)];
    if (plan.vehicles === 2) this.vehicles.push(new Vehicle(2, { legs: { width: 14, height: 9, x: 18, y: 4 } }));
    this.start(plan);
  }

  start(plan) {
    if (plan.wide) this.vehicles[0].surveyWidely();
    this.advance(plan.advance);
    const [first] = this.vehicles;
    if (plan.silent) {
      first.silent = true;
      this.advance(plan.after);
    }
    if (plan.refuse) {
      first.directive.refuseNext.add("utility");
      this.utility(first, { weights: { 2: 0.6, 3: 0.8 }, exploration: 0.3 });
      this.advance(40);
    }
  }

  /** Runs `seconds` of mission time; returns the ids of vehicles whose map changed. */
  advance(seconds) {
    const changed = new Set();
    const dt = 0.5;
    for (let left = seconds; left > 0 && !this.ended; left -= dt) {
      const step = Math.min(dt, left);
      this.nowS += step;
      for (const v of this.vehicles) {
        if (v.step(this.nowS, step, this.loss, this.budgetBps)) changed.add(v.id);
      }
      this.surfaceTurn();
      this.remember();
    }
    return changed;
  }

  surfaceTurn() {
    if (this.deliverS !== null && this.nowS >= this.deliverS) {
      for (const v of this.vehicles) v.directive.deliver(this.nowS, this.arrived && !v.silent);
      this.deliverS = null;
    }
    if (this.nowS < this.nextDownS) return;
    this.nextDownS = this.nowS + 6;
    const waiting = this.vehicles.some((v) => [...v.directive.slots.values()].some((s) => s.state === "queued"));
    this.arrived = this.down.send(this.nowS, { directive: waiting ? 31 : 4, status: 6 }, this.loss);
    for (const v of this.vehicles) v.directive.transmit(this.nowS);
    this.deliverS = this.nowS + 1.5;
  }

  remember() {
    const last = this.history.at(-1);
    if (last && this.nowS - last.t_s < 2) return;
    this.history.push({ t_s: this.nowS, up_bps: this.rateUp(), down_bps: this.down.rateAt(this.nowS) });
    this.history = this.history.slice(-300);
  }

  rateUp() {
    return this.vehicles.reduce((sum, v) => sum + v.up.rateAt(this.nowS), 0);
  }

  /** The highest rates count from the change of the budget on. */
  handleBudget() {
    for (const direction of [this.down, ...this.vehicles.map((v) => v.up)]) direction.maxBps = 0;
  }

  utility(v, { weights, exploration = 0, curiosity = 0 }) {
    for (const [id, w] of Object.entries(weights)) v.weights.set(Number(id), w);
    Object.assign(v.terms, { exploration, curiosity });
    return v.directive.issue("utility", this.nowS);
  }

  json() {
    return {
      now_s: this.nowS,
      mission: { name: this.name, id: `mock-${this.name}`, speed: this.speed, ended: this.ended, ended_s: this.ended ? this.nowS : null },
      vehicles: this.vehicles.map((v) => v.json(this.nowS)),
      position: this.position ?? null,
      storage: this.storage ?? null,
      log: this.log.length,
      command: this.command.json(),
      truth: this.truth ? TRUTH : null,
      layers: LAYERS.map(({ name, unit }) => ({ name, unit, summary: `what ${name} means` })),
      link: {
        budget_bps: this.budgetBps, shares: this.shares, background: this.background, budget_window_s: 10,
        down: this.down.json(this.nowS), up: this.vehicles[0].up.json(this.nowS),
        round_trip_s: this.vehicles[0].receivedS === null ? null : 1.62,
        energy_per_map_bit_j: this.energyPerMapBit(),
        backlog_bits: this.vehicles[0].reported?.bits ?? null,
        history: this.history,
      },
    };
  }

  energyPerMapBit() {
    const { energy_j: energy, bytes_by_class: bytes } = this.vehicles[0].up.json(this.nowS);
    return bytes.map > 0 ? energy / (8 * bytes.map) : null;
  }
}
