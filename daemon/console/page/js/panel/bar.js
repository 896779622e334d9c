// The line at the top: mission, vehicles to choose from, mission time, the state of the feed.

import { $, h, keyed, text } from "../dom.js";
import { missionTime, span } from "../format.js";
import { ageOf, isSilent, store } from "../store.js";

export function startBar() {
  store.on("state select feed tick", update);
}

function update() {
  const feed = $("feed");
  const lost = store.feed.state === "lost";
  text(feed, store.connected ? "Live" : lost ? "Not connected" : "Connecting");
  if (!store.snapshot) return;
  const { mission, vehicles } = store.snapshot;
  text($("mission"), mission.speed === 1 ? mission.name : `${mission.name} ×${mission.speed}`);
  text($("clock"), missionTime(store.nowS));
  keyed($("vehicles"), vehicles, (v) => v.id, make, refresh);
  document.title = `${vehicles.some(isSilent) ? "(silent) " : ""}scenecast: ${mission.name}`;
}

function make(vehicle) {
  return h("button.craft", { type: "button", onclick: () => store.select(vehicle.id) },
    h("span.dot", { "aria-hidden": "true" }), h("span.name"), h("span.heard"));
}

function refresh(node, vehicle) {
  const silent = isSilent(vehicle);
  const heard = vehicle.heard_s === null ? "not heard yet" : `heard ${span(ageOf(vehicle.heard_s))} ago`;
  node.setAttribute("aria-pressed", String(vehicle.id === store.selectedId));
  node.dataset.state = !store.connected ? "none" : silent ? "silent" : vehicle.heard_s === null ? "none" : "heard";
  text(node.children[1], vehicle.name);
  text(node.children[2], silent && vehicle.heard_s !== null ? `silent ${span(ageOf(vehicle.heard_s))}` : heard);
}
