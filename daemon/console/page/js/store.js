// What the page knows: the last state from the daemon, how old it is, the chosen vehicle, the maps.

import { readMap } from "./api.js";

export const store = new (class extends EventTarget {
  snapshot = null;
  receivedMs = 0;
  feed = { state: "connecting", sinceMs: performance.now(), retryMs: 0 };
  selectedId = null;
  maps = new Map();
  /** Why the map of a vehicle is not the newest, by vehicle. */
  mapFaults = new Map();
  #fetching = new Set();

  /** Calls `fn` on each named event: state, map, feed, select, tick, book, highlight. */
  on(names, fn) {
    for (const name of names.split(" ")) this.addEventListener(name, fn);
  }

  tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  take(snapshot) {
    const first = this.snapshot === null;
    if (!first && snapshot.now_s < this.snapshot.now_s - 5) this.maps.clear();
    this.snapshot = snapshot;
    this.receivedMs = performance.now();
    if (!this.vehicle) this.selectedId = snapshot.vehicles[0]?.id ?? null;
    this.tell("state");
    if (first) performance.mark("scenecast-ready");
    for (const v of snapshot.vehicles) this.wantMap(v.id, v.map);
  }

  select(id) {
    this.selectedId = id;
    this.tell("select");
  }

  get vehicle() {
    return this.snapshot?.vehicles.find((v) => v.id === this.selectedId) ?? null;
  }

  get map() {
    return this.maps.get(this.selectedId) ?? null;
  }

  /** Mission time now: the server's clock, carried on by ours between two states. */
  get nowS() {
    if (!this.snapshot) return 0;
    const { now_s, mission } = this.snapshot;
    if (mission.ended) return now_s;
    return now_s + ((performance.now() - this.receivedMs) / 1000) * mission.speed;
  }

  get connected() {
    return this.feed.state === "open";
  }

  /** Fetches a map when its version or epoch is not the one here; one fetch a vehicle at a time. */
  async wantMap(id, seen) {
    const have = this.maps.get(id);
    if (have && have.version === seen.version && have.epoch === seen.epoch) return;
    if (this.#fetching.has(id)) return;
    if (seen.width === 0 || seen.height === 0) {
      this.maps.set(id, { ...seen, labels: new Uint8Array(0), age: new Uint16Array(0), planes: [], fetchedS: this.nowS });
      this.tell("map", { id });
      return;
    }
    this.#fetching.add(id);
    try {
      const map = await readMap(id);
      const said = this.snapshot?.vehicles.find((v) => v.id === id)?.map;
      this.maps.set(id, { ...map, epoch: said?.epoch ?? 0, fetchedS: map.at_s ?? this.nowS });
      this.mapFaults.delete(id);
      this.tell("map", { id });
    } catch (error) {
      this.mapFaults.set(id, error.message);
    } finally {
      this.#fetching.delete(id);
    }
  }
})();

/** Seconds since a time on the mission clock, or null. */
export const ageOf = (s) => (s === null || s === undefined ? null : Math.max(0, store.nowS - s));

/** Silent: nothing heard for three times the expected interval. A mission that ended is not silent. */
export function isSilent(vehicle) {
  if (store.snapshot.mission.ended) return false;
  const age = vehicle.heard_s === null ? store.nowS : ageOf(vehicle.heard_s);
  return age > 3 * vehicle.expected_interval_s;
}

/** Stale: what is shown of this vehicle may no longer be so. */
export const isStale = (vehicle) => !store.connected || isSilent(vehicle);
