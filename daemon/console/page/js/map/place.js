// The place that the operator has chosen on the map, and the markers around it. Places are in the world frame, metres.

import { FONT, haloText } from "../canvas.js";
import { pen } from "../fence/edit.js";
import { store } from "../store.js";
import { destinationOf, isSamePlace } from "./destination.js";

const REACH_PX = 14;
const MAX_TEXT = 24;

/** The chosen place [x, y], or null, and the number of the chosen marker, or null. */
export const chosen = { at: null, marker: null };

store.on("select", clearPlace);
// The plate of a place would cover corners of an outline.
store.on("edit", () => pen.tool !== null && clearPlace());

export const markers = () => store.vehicle?.markers ?? [];

/** The chosen marker, or null once it was removed. */
export const chosenMarker = () => markers().find((m) => m.number === chosen.marker) ?? null;

/** Whether the chosen place is the destination of the vehicle. */
export const isDestination = () => isSamePlace(destinationOf(store.vehicle), chosen.at);

/** Chooses the place at a click on the map, or the marker or the destination within reach of it. */
export function choosePlace(view, px, py) {
  const away = (place) => Math.hypot(...view.toScreen(...place).map((v, i) => v - [px, py][i]));
  const at = (m) => [m.x_m, m.y_m];
  const near = markers().filter((m) => away(at(m)) <= REACH_PX).sort((a, b) => away(at(a)) - away(at(b)))[0];
  const destination = destinationOf(store.vehicle);
  const isNear = destination !== null && away(destination) <= REACH_PX;
  chosen.at = near ? at(near) : isNear ? destination : view.toWorld(px, py);
  chosen.marker = near?.number ?? null;
  store.emit("place");
}

export function clearPlace() {
  if (chosen.at === null) return;
  [chosen.at, chosen.marker] = [null, null];
  store.emit("place");
}

export function drawPlaces(c, view, ink) {
  c.font = FONT;
  c.textAlign = "left";
  for (const marker of markers()) drawMarker(c, ink, view.toScreen(marker.x_m, marker.y_m), marker.text);
  if (!chosen.at) return;
  const [px, py] = view.toScreen(...chosen.at);
  for (const [style, width] of [[ink.sea, 4], [ink.accent, 2]]) {
    c.strokeStyle = style;
    c.lineWidth = width;
    c.beginPath();
    c.arc(px, py, 9, 0, 2 * Math.PI);
    c.stroke();
  }
}

/** A pin with the beginning of its text. */
function drawMarker(c, ink, [px, py], words) {
  c.beginPath();
  c.moveTo(px, py);
  c.lineTo(px - 5, py - 11);
  c.arc(px, py - 13, 5.4, Math.PI * 0.88, Math.PI * 0.12);
  c.closePath();
  c.lineJoin = "round";
  c.lineWidth = 3;
  c.strokeStyle = ink.sea;
  c.stroke();
  c.fillStyle = ink.accent;
  c.fill();
  haloText(c, words.length > MAX_TEXT ? `${words.slice(0, MAX_TEXT - 1)}…` : words, px + 9, py - 9, ink);
}
