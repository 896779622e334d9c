// The bar at the top: mission, choice of vehicle, mission time, state of the feed.

import { $, h, keyed, show, text } from "../dom.js";
import { missionTime, span, utc } from "../format.js";
import { ageOf, isSilent, store } from "../store.js";

/** The speed of a rehearsal that has just begun is not measured yet. */
const LEAST_SPEED = 0.05;

export function startBar() {
  store.on("state select feed tick", update);
}

function update() {
  const feed = $("feed");
  const lost = store.feed.state === "lost";
  text(feed, store.connected ? (store.replay ? "Record" : "Live") : lost ? "Not connected" : "Connecting");
  if (!store.snapshot) return;
  const { mission, vehicles } = store.snapshot;
  text($("mission"), mission.speed === 1 || mission.speed < LEAST_SPEED || store.replay ? mission.name : `${mission.name} ×${Number(mission.speed.toPrecision(2))}`);
  text($("clock"), missionTime(store.nowS));
  text($("utc"), store.utcS === null ? "" : utc(store.utcS).slice(11));
  keyed($("vehicles"), vehicles, (v) => v.id, make, refresh);
  // Command and alarms are of the present.
  for (const id of ["command", "sound"]) show($(id), !store.replay);
  document.title = `${store.replay ? "(record) " : ""}${vehicles.some(isSilent) ? "(silent) " : ""}scenecast: ${mission.name}`;
}

function make(vehicle) {
  return h("button.vehicle-choice", { type: "button", onclick: () => store.select(vehicle.id) },
    h("span.dot", { "aria-hidden": "true" }), h("span.name"), h("span.received", { title: "Time since the last frame of this vehicle was received" }));
}

function refresh(node, vehicle) {
  const silent = isSilent(vehicle);
  const received = vehicle.last_received_s === null ? "no frame yet" : `received ${span(ageOf(vehicle.last_received_s))} ago`;
  node.setAttribute("aria-pressed", String(vehicle.id === store.selectedId));
  node.dataset.state = !store.connected ? "none" : silent ? "silent" : vehicle.last_received_s === null ? "none" : "received";
  text(node.children[1], vehicle.name);
  text(node.children[2], silent && vehicle.last_received_s !== null ? `silent ${span(ageOf(vehicle.last_received_s))}` : received);
}
