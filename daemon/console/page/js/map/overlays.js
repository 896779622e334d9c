// Overlays that belong to no vehicle: grid, scale bar, north arrow, range rings.

import { FONT, haloText } from "../canvas.js";
import { metres, minus, nice } from "../format.js";

export function drawGrid(c, view, ink) {
  const step = nice(120 / view.scale) || 1;
  const [west, north] = view.toWorld(0, 0);
  const [east, south] = view.toWorld(view.width, view.height);
  const digits = step < 1 ? 1 : 0;
  c.strokeStyle = ink.grid;
  c.lineWidth = 1;
  c.font = FONT;
  c.beginPath();
  const marks = [];
  for (let i = Math.ceil(west / step); i * step <= east; i += 1) {
    const px = Math.round(view.toScreen(i * step, 0)[0]) + 0.5;
    c.moveTo(px, 0);
    c.lineTo(px, view.height);
    if (px > 70 && px < view.width - 150) marks.push([minus((i * step).toFixed(digits)), px, view.height - 6, "center"]);
  }
  for (let i = Math.ceil(south / step); i * step <= north; i += 1) {
    const py = Math.round(view.toScreen(0, i * step)[1]) + 0.5;
    c.moveTo(0, py);
    c.lineTo(view.width, py);
    if (py > 50 && py < view.height - 50) marks.push([minus((i * step).toFixed(digits)), 6, py + 4, "left"]);
  }
  c.stroke();
  for (const [string, x, y, align] of marks) {
    c.textAlign = align;
    haloText(c, string, x, y, ink);
  }
}

export function drawScaleBar(c, view, ink) {
  const length = nice(150 / view.scale);
  const px = length * view.scale;
  const right = view.width - 14.5;
  const y = view.height - 14.5;
  for (const [style, width] of [[ink.sea, 5], [ink.text, 1.5]]) {
    c.strokeStyle = style;
    c.lineWidth = width;
    c.beginPath();
    c.moveTo(right - px, y - 6);
    c.lineTo(right - px, y);
    c.lineTo(right, y);
    c.lineTo(right, y - 6);
    c.stroke();
  }
  c.font = FONT;
  c.textAlign = "center";
  haloText(c, metres(length, length < 1 ? 1 : 0), right - px / 2, y - 5, ink);
}

export function drawNorth(c, view, ink) {
  const x = view.width - 26;
  const y = 14;
  c.beginPath();
  c.moveTo(x, y);
  c.lineTo(x + 7, y + 22);
  c.lineTo(x, y + 17);
  c.lineTo(x - 7, y + 22);
  c.closePath();
  c.lineWidth = 3;
  c.lineJoin = "round";
  c.strokeStyle = ink.sea;
  c.stroke();
  c.fillStyle = ink.text;
  c.fill();
  c.font = FONT;
  c.textAlign = "center";
  haloText(c, "N", x, y + 35, ink);
}

/** Rings around (x, y) at round ranges. */
export function drawRings(c, view, ink, x, y) {
  const step = nice(160 / view.scale);
  const [px, py] = view.toScreen(x, y);
  const reach = Math.hypot(view.width, view.height) / view.scale;
  c.font = FONT;
  c.textAlign = "center";
  for (let i = 1; i * step < reach && i < 12; i += 1) {
    c.setLineDash([2, 4]);
    c.lineWidth = 1;
    c.strokeStyle = ink.text;
    c.beginPath();
    c.arc(px, py, i * step * view.scale, 0, 2 * Math.PI);
    c.stroke();
    c.setLineDash([]);
    haloText(c, metres(i * step, step < 1 ? 1 : 0), px, py - i * step * view.scale - 3, ink);
  }
}
