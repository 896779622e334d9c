// A record of the synthetic mission, as `scenecast replay` serves one: the mission is played again up to the moment that is shown.

import { Grid } from "./grid.mjs";
import { Mission } from "./mission.mjs";

const LENGTH_S = 330;
export const FROM_UTC_S = Date.UTC(2026, 10, 29, 10, 15) / 1000;
export const REFUSAL = "this is a record: it takes no orders";

/** Seconds of the record, kind of the mark, kind in the log, and text. The log has no loops. */
const EVENTS = [
  [20, "label", "label", "label 1 is on the map"], [45, "order", "order", "weights: label 3 +0.80"], [58, "order", "answer", "utility version 1 applied"],
  [90, "vehicle", null, "on board: checkpoint written"], [120, "silence", "contact", "silent for 2 min 5 s"], [150, "loop", null, "3 frames have closed a loop"],
  [180, "label", "label", "label 4 is on the map"], [215, "fault", "fault", "camera: no frames"], [240, "mode", "mode", "holding: order"],
  [300, "order", "order", "fence: 4 corners"],
];
const utc = (atS) => new Date(1000 * (FROM_UTC_S + atS)).toISOString();

export class Replay {
  atS = 200;
  isPlaying = false;
  playSpeed = 10;
  side = "operator";
  sides = ["operator", "vehicle", "difference"];
  /** Events that a story adds. */
  further = [];
  #mission = new Mission("empty");
  #shown = null;
  #version = 0;

  constructor() {
    this.#seek(this.atS);
  }

  get vehicles() {
    return this.#mission.vehicles;
  }

  get nowS() {
    return this.#mission.nowS;
  }

  get speed() {
    return this.playSpeed;
  }

  /** The log up to the moment. */
  get log() {
    const logged = EVENTS.filter(([, , kind]) => kind !== null);
    const entries = logged.map(([at_s, , kind, text], i) => ({ number: i + 1, at_s, utc: utc(at_s), by: null, vehicle: 1, kind, text }));
    return entries.filter((entry) => entry.at_s <= this.atS);
  }

  principal() {
    return { name: "local", role: "viewer" };
  }

  /** Moves on, if the record is played. */
  advance(seconds) {
    if (!this.isPlaying) return [];
    this.#seek(this.atS + seconds);
    this.isPlaying = this.atS < LENGTH_S;
    return [];
  }

  /** A mission runs forwards only, so an earlier moment begins another one. */
  #seek(atS) {
    this.atS = Math.min(LENGTH_S, Math.max(0, atS));
    if (this.atS < this.#mission.nowS) this.#mission = new Mission("empty");
    this.#mission.advance(this.atS - this.#mission.nowS);
    this.#show();
  }

  /** Each map that is shown has a number of its own. */
  #show() {
    this.#shown = new Map(this.vehicles.map((v) => [v.id, { operator: v.replica, vehicle: v.own, difference: difference(v) }[this.side]]));
    for (const grid of this.#shown.values()) {
      this.#version = Math.max(this.#version, grid.version) + 1;
      grid.version = this.#version;
    }
  }

  /** The bytes of a vehicle's map. */
  mapBytes(vehicle, since) {
    return this.#shown.get(vehicle.id).bytes(this.nowS, [], since);
  }

  change({ at_utc_s: at, is_playing: isPlaying, speed, side }) {
    if (speed !== undefined && !(speed >= 0.1 && speed <= 1000)) return `speed ${speed}: the range is 0.1 to 1000`;
    if (side !== undefined && !this.sides.includes(side)) return `side ${side}: the record of the other end is missing`;
    this.playSpeed = speed ?? this.playSpeed;
    this.side = side ?? this.side;
    this.isPlaying = isPlaying ?? this.isPlaying;
    const again = isPlaying === true && this.atS >= LENGTH_S;
    this.#seek(again ? 0 : at === undefined ? this.atS : at - FROM_UTC_S);
    return null;
  }

  events() {
    const events = EVENTS.map(([atS, kind, , text]) => ({ at_utc_s: FROM_UTC_S + atS, kind, vehicle: 1, text }));
    return [...events, ...this.further].sort((a, b) => a.at_utc_s - b.at_utc_s);
  }

  replay() {
    const { isPlaying: is_playing, playSpeed: speed, side, sides } = this;
    return {
      from_utc_s: FROM_UTC_S, to_utc_s: FROM_UTC_S + LENGTH_S, at_utc_s: FROM_UTC_S + this.atS, is_playing, speed, mission_speed: 1, side, sides,
      differing_cells: sides.length > 1 ? this.vehicles.map((v) => ({ vehicle: v.id, cells: difference(v).size })) : [],
      damage: [],
    };
  }

  json() {
    const state = this.#mission.json();
    const vehicles = state.vehicles.map((v) => {
      const grid = this.#shown.get(v.id);
      return { ...v, map: { ...v.map, version: grid.version, ...grid.bounds(), explored_cells: grid.size } };
    });
    const mission = { ...state.mission, name: "record", id: "mock-record", speed: this.isPlaying ? this.playSpeed : 0 };
    return { ...state, mission, vehicles, log: this.log.length, replay: this.replay() };
  }
}

/** The cells in which the operator's map differs from the vehicle's, with the vehicle's label. */
function difference({ own, replica }) {
  const grid = new Grid(own.cellM);
  own.each((x, y, label) => {
    if (replica.label(x, y) !== label) grid.set(x, y, label, 0);
  });
  return grid;
}
