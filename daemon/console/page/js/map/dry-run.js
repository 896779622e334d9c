// A dry run: what the vehicle would do by weights that are not sent. It is drawn until they are sent or changed, or it is closed.

import { FONT, haloText } from "../canvas.js";
import { missionKey, store } from "../store.js";
import { drawLegs, drawTargets } from "./path.js";

let shown = null;

/** Shows a dry run of a vehicle. `weights` is what it was planned for, as a text. */
export function showDryRun(vehicle, weights, run) {
  shown = { key: missionKey(vehicle), weights, run };
  store.emit("edit");
}

export function forgetDryRun() {
  if (!shown) return;
  shown = null;
  store.emit("highlight");
}

/** The dry run of a vehicle for these weights, or null. */
export function dryRunOf(vehicle, weights) {
  if (shown && !store.replay && shown.key === missionKey(vehicle) && shown.weights === weights) return shown.run;
  return null;
}

/** Draws it; `view` takes places on the vehicle's map. */
export function drawDryRun(c, view, ink, vehicle) {
  if (!shown || store.replay || shown.key !== missionKey(vehicle)) return;
  const { from, legs, targets } = shown.run;
  if (legs.length === 0) return;
  drawTargets(c, view, ink, targets, store.maps.get(vehicle.id)?.cell_m ?? vehicle.map.cell_m);
  drawLegs(c, view, ink, from, legs, [9, 6], 3);
  const [x, y] = view.toScreen(...legs.at(-1).to);
  c.font = FONT;
  c.textAlign = "left";
  haloText(c, "Dry run, not sent", x + 8, y - 6, ink);
}
