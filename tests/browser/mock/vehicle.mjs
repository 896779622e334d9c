// One synthetic vehicle: flies legs over the scene, sends its map in turns, receives directives.

import { habitat, confidence, floorDepth, surprise } from "./scene.mjs";
import { Grid } from "./grid.mjs";
import { Direction } from "./link.mjs";
import { Directive } from "./directive.mjs";
import { Settings } from "./settings.mjs";

/** The bounds of levels of equal width. */
const equal = (low, step, levels) => Array.from({ length: levels + 1 }, (_, i) => low + i * step);

export const LAYERS = [
  { name: "depth", unit: "m", edges: equal(10, 0.5, 30), palette: "cividis", spread: "scale", is_depth: true, at: floorDepth },
  { name: "confidence", unit: "", edges: equal(0, 0.25, 4), palette: "cividis", spread: "scale", is_depth: false, at: confidence },
  { name: "last_seen", unit: "min", edges: [0, 2, 4, 8, 16, 32], palette: "cividis", spread: "present", is_depth: false, at: Math.hypot },
  { name: "curiosity", unit: "bit", edges: equal(2, 1, 9), palette: "inferno", spread: "common", is_depth: false, at: surprise },
];

/** A tree in which the highest label joins the first one, the next the second, and so on. */
function treeOf(ids) {
  if (ids.length < 3) return null;
  const merges = ids.slice(1).reverse().map((joins, k) => [ids[k % Math.max(1, ids.indexOf(joins))], joins]);
  return { merges, clearest: merges.length };
}

export class Vehicle {
  constructor(id, { turnS = 12, speed = 0.9, legs = { width: 24, height: 15, x: -9, y: -5 }, cellM = 0.25, footprint = 1.4 } = {}) {
    Object.assign(this, { id, turnS, speed, legs, footprint });
    this.name = `auv-${id}`;
    this.own = new Grid(cellM);
    this.replica = new Grid(cellM);
    this.up = new Direction(97 + id);
    this.directive = new Directive();
    this.published = new Map();
    this.weights = new Map();
    this.terms = { exploration: 0.2, curiosity: 0 };
    Object.assign(this, { reported: null, knownInForce: {}, inForce: {}, draft: { number: 0, weights: {}, exploration: null, curiosity: null, at_s: 0, author: "" }, fence: null, limits: null, areas: null, destination: null, planner: null, settings: new Settings(), coarse: false, aborted: false });
    this.exemplars = new Map();
    this.withoutImage = new Set();
    this.markers = [];
    this.track = [];
    this.hold = false;
    this.silent = false;
    this.receivedS = null;
    this.status = null;
    this.faults = [];
    this.disk = { journal_refused: false, checkpoint_refused: false, free_bytes: 2 ** 34 };
    this.alongM = 0;
    this.pending = new Map();
    this.nextTurnS = 4 + 3 * id;
    this.fixS = 0;
  }

  /** Position on the lawn-mower pattern, in metres east and north, with heading. */
  pose() {
    const { x, y, width, height } = this.legs;
    const lane = 1.9;
    const period = width + lane;
    const lanes = Math.floor(height / lane) + 1;
    const n = Math.floor(this.alongM / period) % lanes;
    const on = this.alongM % period;
    const east = n % 2 === 0;
    const wander = 0.25 * Math.sin(this.alongM / 3.1);
    if (on > width) return { x: x + (east ? width : 0), y: y + n * lane + (on - width), heading: 0 };
    const heading = (east ? 90 : 270) + (east ? -1 : 1) * 5 * Math.cos(this.alongM / 3.1);
    return { x: x + (east ? on : width - on), y: y + n * lane + wander, heading };
  }

  step(nowS, dt, loss, budgetBps) {
    if (!this.hold && !this.aborted) this.alongM += this.speed * dt;
    const p = this.pose();
    this.observe(p, nowS);
    if (nowS - this.fixS > 40) this.fixS = nowS;
    if (nowS < this.nextTurnS) return false;
    this.nextTurnS = nowS + this.turnS;
    return !this.silent && this.report(p, nowS, loss, budgetBps);
  }

  observe(p, nowS) {
    const cell = this.own.cellM;
    const reach = Math.ceil(this.footprint / cell);
    const [cx, cy] = [Math.floor(p.x / cell), Math.floor(p.y / cell)];
    for (let dy = -reach; dy <= reach; dy += 1)
      for (let dx = -reach; dx <= reach; dx += 1) {
        if (dx * dx + dy * dy > reach * reach) continue;
        const [x, y] = [cx + dx, cy + dy];
        const kind = habitat((x + 0.5) * cell, (y + 0.5) * cell);
        if (!this.published.has(kind)) this.published.set(kind, this.published.size + 1);
        this.pending.set(`${x},${y}`, { x, y, label: this.published.get(kind) });
        this.own.set(x, y, this.published.get(kind), nowS);
      }
  }

  report(p, nowS, loss, budgetBps) {
    const exemplar = [...this.exemplars.values()].find((e) => e.state === "receiving");
    const room = 0.7 * budgetBps * 1.25;
    const parts = { map: Math.min(room, 900 + this.pending.size * 6), status: 22, directive: 3, exemplar: exemplar ? 96 : 0 };
    if (!this.up.send(nowS, parts, loss)) return false;
    this.receivedS = nowS;
    for (const [key, c] of this.pending) {
      if (this.coarse && (c.x % 4 !== 0 || c.y % 4 !== 0)) continue;
      this.replica.set(c.x, c.y, c.label, nowS);
      this.pending.delete(key);
    }
    this.reported = { at_s: nowS - 0.8, bits: this.pending.size * 8 + 1200 };
    this.replica.version += 1;
    this.updatedS = nowS;
    this.status = {
      at_s: nowS - 0.8, x_m: p.x, y_m: p.y, z_m: -16.4 - 0.6 * Math.sin(nowS / 30),
      heading_deg: (p.heading + 360) % 360, sigma_m: 0.6 + 0.03 * (nowS - this.fixS),
      mode: this.aborted ? "abort" : this.hold ? "hold" : "survey",
      activity: this.aborted ? "aborted: order" : this.hold ? "holding: order" : "surveying",
      ...this.path(),
      cells: this.own.size, labels: this.published.size, fix_age_s: nowS - this.fixS, disk: this.disk,
      faults: this.faults,
    };
    this.track.push([nowS, p.x, p.y]);
    this.track = this.track.slice(-500);
    this.directive.acknowledge(nowS);
    if (exemplar) this.progress(exemplar, nowS);
    return true;
  }

  /** Waypoint and path: the corners of the pattern from here on, one fewer where the lane has ended. */
  path() {
    if (this.hold || this.aborted) return { waypoint: null, path: [], path_continues: false };
    const { x, y, width, height } = this.legs;
    const lane = 1.9;
    const lanes = Math.floor(height / lane) + 1;
    const n = Math.floor(this.alongM / (width + lane)) % lanes;
    const at = (i) => [x + (i % 2 === 0 ? width : 0), y + i * lane];
    const corners = [];
    for (let i = n; i < lanes; i += 1) corners.push(at(i), ...(i + 1 < lanes ? [[at(i)[0], y + (i + 1) * lane]] : []));
    if (this.alongM % (width + lane) > width && corners.length > 1) corners.shift();
    return { waypoint: corners[0], path: corners.slice(1, 8), path_continues: corners.length > 8 };
  }

  progress(e, nowS) {
    e.progress = Math.min(1, e.progress + 0.25);
    if (e.progress < 1) return;
    e.state = "received";
    e.at_s = nowS;
    const number = e.larger ?? 10 * e.label + e.images.length;
    const kept = e.images.filter((i) => i.number !== number);
    const url = `/api/v2/vehicles/${this.id}/exemplars/${e.label}-${number}.webp`;
    const size = e.larger ? 128 : 64;
    e.images = [...kept, { number, edge_px: size, can_enlarge: size < 128, bytes: e.bytes, url, at_s: nowS, taken_s: nowS - 40, width_m: 0.26, x_m: 12.3, y_m: -4.5, requested: true }];
  }

  request({ label, action = "another", image = null }, nowS) {
    const before = this.exemplars.get(label);
    const images = before?.images ?? [];
    const state = action === "cancel" ? (images.length > 0 ? "received" : "none") : "queued";
    const larger = action === "larger" ? image ?? images.at(-1).number : null;
    const bytes = (larger ? 4 : 1) * (380 + 24 * label);
    this.exemplars.set(label, { label, state, progress: 0, bytes, at_s: null, larger, images });
    return this.directive.issue("requests", nowS, (done) => {
      const queued = [...this.exemplars.values()].filter((x) => x.state === "queued");
      for (const x of queued) x.state = done === "refused" ? "refused" : this.withoutImage.has(x.label) ? "not_available" : "receiving";
    });
  }

  /** Sets a marker, or removes the one with the number `remove`. */
  mark({ remove, ...marker }, nowS) {
    this.markers = this.markers.filter((m) => m.number !== remove);
    if (remove === undefined) this.markers.push({ number: 1 + (this.markers.at(-1)?.number ?? 0), at_s: nowS, ...marker });
  }

  exemplarJson(label) {
    const e = this.exemplars.get(label);
    if (!e) return { state: "none", progress: 0, bytes: null, url: null, at_s: null, images: [] };
    const slot = this.directive.slots.get("requests");
    const state = e.state === "queued" && slot.state !== "queued" ? "on_air" : e.state;
    const url = e.images.length > 0 ? `/api/v2/vehicles/${this.id}/exemplars/${label}.webp` : null;
    return { state, progress: e.progress, bytes: e.bytes, url, at_s: e.at_s ?? e.images.at(-1)?.at_s ?? null, images: e.images };
  }

  /** Gives the cell at a place of the map another label, as a frame of now. */
  setLabel({ x_m, y_m, label }, nowS) {
    this.replica.set(Math.floor(x_m / this.replica.cellM), Math.floor(y_m / this.replica.cellM), label, nowS);
    this.replica.version += 1;
    this.updatedS = nowS;
  }

  /** Sets when the last frame came in and when the next one was due, for as long as the mission does not advance. */
  setContact(nowS, { received_s_ago, due_s_ago }) {
    this.receivedS = nowS - received_s_ago;
    this.nextTurnS = nowS - due_s_ago;
  }

  json(nowS) {
    const bounds = this.replica.bounds();
    const area = this.replica.cellM ** 2;
    const counts = [...this.replica.counts()].sort((a, b) => a[0] - b[0]);
    return {
      id: this.id, name: this.name, last_received_s: this.receivedS, expected_interval_s: this.turnS,
      next_contact_s: this.receivedS === null ? null : this.nextTurnS, other_surface: this.otherSurface ?? null, status: this.status, track: this.track,
      aims: this.aims ?? null, favoured_time: this.favouredTime ?? null,
      registration: this.registration ?? null, closed_loops: this.closedLoops ?? [],
      map: {
        version: this.replica.version, cell_m: this.replica.cellM, ...bounds,
        explored_cells: this.replica.size, updated_s: this.updatedS ?? null, epoch: 0, placement: this.placement ?? null, earlier: this.earlier ?? null,
      },
      labels: counts.map(([id, cells]) => ({
        id, cells, area_m2: cells * area, gained_m2: (id % 2 ? 0.25 : -0.125) * cells * area, weight: this.weights.get(id) ?? 0, exemplar: this.exemplarJson(id),
      })),
      label_tree: treeOf(counts.map(([id]) => id)),
      draft: this.draft, utility: this.terms, fence: this.fence, limits: this.limits, areas: this.areas, destination: this.destination, planner: this.planner, settings: this.settings.json(),
      in_force: { utility: "known", settings: "none", budget: "known", limits: this.inForce.limits ? "known" : "none", fence: this.inForce.fence ? "known" : "none", areas: this.inForce.areas ? "known" : "none", destination: this.inForce.destination ? "known" : "none", ...this.knownInForce },
      fence_in_force: this.inForce.fence ?? null, limits_in_force: this.inForce.limits ?? null,
      areas_in_force: this.inForce.areas ?? null, destination_in_force: this.inForce.destination?.order.place ? this.inForce.destination : null,
      directive: this.directive.json(), link: this.link(nowS), floor: { images: 0, bytes: 0, version: 0, epoch: 0 }, usbl: null, markers: this.markers,
    };
  }

  link(nowS) {
    const { loss, goodput_bps: goodput } = this.up.json(nowS);
    const up = { loss, goodput_bps: goodput };
    return {
      up, down: { loss, goodput_bps: 12 }, round_trip_s: this.receivedS === null ? null : 1.62,
      one_way_s: this.receivedS === null ? null : 0.81, clock_offset_s: 0, dropped: {}, mismatch: this.mismatch ?? null, backlog: this.backlog(nowS, goodput),
    };
  }

  /** The backlog of its last report. */
  backlog(nowS, goodput) {
    if (this.reported === null) return null;
    const { at_s, bits } = this.reported;
    const takes = (n) => (n === 0 ? 0 : goodput >= 1 ? n / goodput : null);
    return {
      at_s, bits, empty_s: takes(bits) === null ? null : nowS + takes(bits),
      map_bits: bits, map_lag_s: takes(bits) === null ? null : nowS - at_s + takes(bits),
    };
  }

  mapBytes(nowS, streams, since) {
    return this.replica.bytes(nowS, LAYERS.filter((p) => streams.includes(p.name)), since);
  }

  /** A survey of a million cells: lanes along two sides of a box of 20 x 20 km, received long ago. */
  surveyWidely() {
    for (const side of [-40000, 39993])
      for (let along = -40000; along < 40000; along += 1)
        for (let across = 0; across < 7; across += 1) {
          this.replica.set(along, side + across, 1 + (((along >> 5) + (across >> 2)) & 3), 10 + ((along + 40000) >> 9));
        }
    this.replica.version += 1;
  }
}
