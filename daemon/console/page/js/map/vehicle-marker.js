// A vehicle on the map: track, uncertainty, planned path, position with heading.

import { FONT, haloText } from "../canvas.js";
import { ageOf, isStale } from "../store.js";
import { span } from "../format.js";
import { drawPath } from "./path.js";

export function drawVehicle(c, view, ink, vehicle, chosen) {
  const stale = isStale(vehicle);
  c.globalAlpha = chosen ? 1 : 0.6;
  drawTrack(c, view, ink, vehicle.track);
  drawClosedLoops(c, view, ink, vehicle.closed_loops ?? []);
  if (vehicle.status) {
    const s = vehicle.status;
    const tone = stale ? ink.stale : ink.vehicle;
    drawPath(c, view, ink, s, stale, vehicle.aims, vehicle.map.cell_m);
    drawSigma(c, view, s, tone);
    drawHull(c, view, ink, s, tone);
    drawName(c, view, ink, vehicle, stale);
  }
  c.globalAlpha = 1;
}

/** The surface vehicle at its GPS position, with its heading and two standard deviations. */
export function drawSurface(c, view, ink, surface) {
  const [px, py] = view.toScreen(surface.x_m, surface.y_m);
  drawSigma(c, view, surface, ink.vehicle);
  if (surface.heading_deg !== null) {
    const bow = (surface.heading_deg * Math.PI) / 180;
    for (const [style, width] of [[ink.sea, 5], [ink.text, 2]]) {
      c.strokeStyle = style;
      c.lineWidth = width;
      c.beginPath();
      c.moveTo(px, py);
      c.lineTo(px + 16 * Math.sin(bow), py - 16 * Math.cos(bow));
      c.stroke();
    }
  }
  c.lineWidth = 3;
  c.strokeStyle = ink.sea;
  c.strokeRect(px - 7, py - 7, 14, 14);
  c.fillStyle = ink.vehicle;
  c.fillRect(px - 6, py - 6, 12, 12);
  c.lineWidth = 1.25;
  c.strokeStyle = ink.text;
  c.strokeRect(px - 6, py - 6, 12, 12);
  c.font = FONT;
  c.textAlign = "left";
  haloText(c, "surface", px + 12, py + 4, ink);
}

function drawTrack(c, view, ink, track) {
  if (track.length < 2) return;
  c.lineJoin = "round";
  for (const [style, width] of [[ink.sea, 3.5], [ink.track, 1.5]]) {
    c.strokeStyle = style;
    c.lineWidth = width;
    c.beginPath();
    for (const [, x, y] of track) c.lineTo(...view.toScreen(x, y));
    c.stroke();
  }
}

/** Small rings where a frame overlapped with an earlier track, which straightens the map. */
function drawClosedLoops(c, view, ink, places) {
  for (const [style, width] of [[ink.sea, 3.5], [ink.track, 1.5]]) {
    c.strokeStyle = style;
    c.lineWidth = width;
    for (const [, x, y] of places) {
      c.beginPath();
      c.arc(...view.toScreen(x, y), 3.5, 0, 2 * Math.PI);
      c.stroke();
    }
  }
}

/** Two standard deviations of the position estimate. */
function drawSigma(c, view, s, tone) {
  const radius = 2 * s.sigma_m * view.scale;
  if (radius < 9) return;
  c.beginPath();
  c.arc(...view.toScreen(s.x_m, s.y_m), radius, 0, 2 * Math.PI);
  c.strokeStyle = tone;
  c.lineWidth = 1.5;
  c.setLineDash([5, 3]);
  c.stroke();
  c.setLineDash([]);
}

function drawHull(c, view, ink, s, tone) {
  const [px, py] = view.toScreen(s.x_m, s.y_m);
  c.save();
  c.translate(px, py);
  c.rotate((s.heading_deg * Math.PI) / 180);
  c.beginPath();
  c.moveTo(0, -12);
  c.lineTo(7.5, 9);
  c.lineTo(0, 5);
  c.lineTo(-7.5, 9);
  c.closePath();
  c.lineJoin = "round";
  c.lineWidth = 4;
  c.strokeStyle = ink.sea;
  c.stroke();
  c.fillStyle = tone;
  c.fill();
  c.lineWidth = 1.25;
  c.strokeStyle = ink.text;
  c.stroke();
  c.restore();
}

function drawName(c, view, ink, vehicle, stale) {
  const { status } = vehicle;
  const [px, py] = view.toScreen(status.x_m, status.y_m);
  const late = stale ? `, ${span(ageOf(status.at_s))} old` : "";
  c.font = FONT;
  const left = px > view.width - 130;
  c.textAlign = left ? "right" : "left";
  haloText(c, vehicle.name + late, px + (left ? -15 : 15), py - 8, ink);
}
