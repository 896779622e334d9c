// The place to which the operator has ordered the vehicle. Places are in the world frame, metres.

import { FONT, haloText } from "../canvas.js";
import { slotOf } from "../order/status.js";

/** Whether the last destination is on its way to the vehicle, which has neither applied nor refused it. */
const isWaiting = (vehicle) => ["queued", "on_air", "received"].includes(slotOf(vehicle, "destination")?.state);

/** The place [x, y] to which a vehicle goes, or is to go once it has the order; null if it has arrived or has none. */
export const destinationOf = (vehicle) =>
  (isWaiting(vehicle) ? vehicle.destination?.place : vehicle?.destination_in_force?.order.place) ?? null;

/** Whether two places are the same on the wire, which counts in decimetres. */
export const isSamePlace = (a, b) => Boolean(a && b) && a.every((metres, i) => Math.abs(metres - b[i]) < 0.06);

export function drawDestination(c, view, ink, vehicle) {
  const place = destinationOf(vehicle);
  if (!place) return;
  const [px, py] = view.toScreen(...place);
  c.beginPath();
  c.arc(px, py, 8, 0, 2 * Math.PI);
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    c.moveTo(px + 4 * dx, py + 4 * dy);
    c.lineTo(px + 13 * dx, py + 13 * dy);
  }
  for (const [style, width, dash] of [[ink.sea, 5, []], [ink.accent, 2.5, isWaiting(vehicle) ? [3, 3] : []]]) {
    c.strokeStyle = style;
    c.lineWidth = width;
    c.setLineDash(dash);
    c.stroke();
  }
  c.setLineDash([]);
  c.font = FONT;
  c.textAlign = "left";
  haloText(c, isWaiting(vehicle) ? "Destination, not in force yet" : "Destination", px + 16, py + 4, ink);
}
