// The data of the page: the last state from the daemon and its age, the selected vehicle, the maps.

import { readTiles } from "./api.js";
import { TiledMap } from "./tiles.js";

export const store = new (class extends EventTarget {
  snapshot = null;
  receivedMs = 0;
  feed = { state: "connecting", sinceMs: performance.now(), retryMs: 0 };
  selectedId = null;
  maps = new Map();
  /** Why the map of a vehicle is not the latest, by vehicle. */
  mapFaults = new Map();
  #fetching = new Set();
  /** Vehicles of which another version was announced while one was being fetched. */
  #announced = new Set();

  /** Calls `fn` on each named event: state, replay, map, feed, select, tick, tab, view, edit, book, highlight, natural, place, theme. */
  on(names, fn) {
    for (const name of names.split(" ")) this.addEventListener(name, fn);
  }

  emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  setSnapshot(snapshot) {
    const first = this.snapshot === null;
    // A record that is set back keeps its maps in view until those of the earlier moment are here.
    if (!first && !snapshot.replay && snapshot.now_s < this.snapshot.now_s - 5) this.maps.clear();
    this.snapshot = snapshot;
    this.receivedMs = performance.now();
    if (!this.vehicle) this.selectedId = snapshot.vehicles[0]?.id ?? null;
    this.emit("state");
    if (first) performance.mark("scenecast-ready");
    for (const v of snapshot.vehicles) this.fetchMap(v.id, v.map);
  }

  /** The moment of a record that is shown, and how it is played; null for a live surface. */
  get replay() {
    return this.snapshot?.replay ?? null;
  }

  select(id) {
    this.selectedId = id;
    this.emit("select");
  }

  get vehicle() {
    return this.snapshot?.vehicles.find((v) => v.id === this.selectedId) ?? null;
  }

  get map() {
    return this.maps.get(this.selectedId) ?? null;
  }

  /** Mission time now: the server's clock, advanced by ours between two states. */
  get nowS() {
    if (!this.snapshot) return 0;
    const { now_s, mission } = this.snapshot;
    // Between two states a fast replay would run far ahead of what it shows.
    if (mission.ended || this.replay) return now_s;
    return now_s + ((performance.now() - this.receivedMs) / 1000) * mission.speed;
  }

  /** The time of day at the surface, seconds since 1970, or null before it is known. */
  get utcS() {
    const { utc_s, mission } = this.snapshot ?? {};
    if (!utc_s) return null;
    return mission.ended || this.replay ? utc_s : utc_s + (performance.now() - this.receivedMs) / 1000;
  }

  get connected() {
    return this.feed.state === "open";
  }

  /** Fetches the tiles that have changed unless we have the map's version and epoch; one request at a time for each vehicle. */
  async fetchMap(id, latest) {
    const have = this.maps.get(id);
    if (have && have.version === latest.version && have.epoch === latest.epoch) return;
    if (this.#fetching.has(id)) {
      this.#announced.add(id);
      return;
    }
    if (latest.width === 0 || latest.height === 0) {
      this.maps.set(id, Object.assign(TiledMap.empty(latest), { epoch: latest.epoch }));
      this.emit("map", { id });
      return;
    }
    this.#fetching.add(id);
    this.#announced.delete(id);
    try {
      const answer = await readTiles(id, have?.tag);
      const summary = this.snapshot?.vehicles.find((v) => v.id === id)?.map;
      this.maps.set(id, Object.assign(new TiledMap(answer, have), { epoch: summary?.epoch ?? 0 }));
      this.mapFaults.delete(id);
      this.emit("map", { id });
    } catch (error) {
      this.mapFaults.set(id, error.message);
    } finally {
      this.#fetching.delete(id);
    }
    // A record that stands still announces its map once.
    const now = this.snapshot?.vehicles.find((v) => v.id === id)?.map;
    if (this.replay && now && this.#announced.has(id)) this.fetchMap(id, now);
  }
})();

/** The mission and the vehicle, as a key of what this page remembers. */
export function missionKey(vehicle) {
  const { mission } = store.snapshot;
  return `${mission.id}.${vehicle.id}`;
}

/** Seconds since a mission time, or null. */
export const ageOf = (s) => (s === null || s === undefined ? null : Math.max(0, store.nowS - s));

/** Silent: no frame for three times the expected interval. A mission that has ended is not silent, nor is a vehicle to itself. */
export function isSilent(vehicle) {
  if (store.snapshot.mission.ended || store.replay?.side === "vehicle") return false;
  const age = vehicle.last_received_s === null ? store.nowS : ageOf(vehicle.last_received_s);
  return age > 3 * vehicle.expected_interval_s;
}

/** Whether a frame of the vehicle came in within the interval in which one is expected. */
export const isHeard = (vehicle) => vehicle.last_received_s !== null && ageOf(vehicle.last_received_s) <= vehicle.expected_interval_s;

/** Stale: the values shown of this vehicle may have changed since. */
export const isStale = (vehicle) => !store.connected || isSilent(vehicle);
