// Rates over time with the budget line, on a small canvas.

import { missionTime, nice, rate } from "../format.js";
import { FONT } from "../canvas.js";
import { colour } from "../theme.js";

const LEFT = 4;
const BOTTOM = 16;
const TOP = 14;

export function drawHistory(canvas, link, nowS) {
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (width === 0) return;
  const ratio = devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const c = canvas.getContext("2d");
  c.scale(ratio, ratio);
  const points = link.history.filter((p) => p.t_s <= nowS);
  const firstS = points[0]?.t_s ?? nowS - 60;
  const spanS = Math.max(60, nowS - firstS);
  const top = Math.max(link.budget_bps, ...points.map((p) => Math.max(p.up_bps, p.down_bps))) * 1.08;
  const x = (t) => LEFT + (width - LEFT - 4) * (1 - (nowS - t) / spanS);
  const y = (bps) => height - BOTTOM - (height - BOTTOM - TOP) * (bps / top);
  const ink = { text: colour("muted"), line: colour("line"), up: colour("up"), down: colour("down"), budget: colour("budget") };
  axes(c, { width, height, x, y, nowS, spanS, ink });
  series(c, points, x, y, "up_bps", ink.up, true);
  series(c, points, x, y, "down_bps", ink.down, false);
  budgetLine(c, width, y(link.budget_bps), ink.budget, link.budget_bps);
  key(c, width, ink);
}

function axes(c, { width, height, x, y, nowS, spanS, ink }) {
  c.font = FONT;
  c.fillStyle = ink.text;
  c.strokeStyle = ink.line;
  c.lineWidth = 1;
  c.beginPath();
  c.moveTo(LEFT, y(0) + 0.5);
  c.lineTo(width - 4, y(0) + 0.5);
  const step = [10, 30, 60, 120, 300, 600, 1800, 3600].find((s) => spanS / s <= 5) ?? nice(spanS / 4);
  for (let t = Math.ceil((nowS - spanS) / step) * step; t <= nowS; t += step) {
    if (t < 0 || x(t) < 26 || x(t) > width - 26) continue;
    c.moveTo(Math.round(x(t)) + 0.5, y(0));
    c.lineTo(Math.round(x(t)) + 0.5, y(0) + 4);
    c.textAlign = "center";
    c.fillText(missionTime(t).slice(2), x(t), height - 2);
  }
  c.stroke();
}

function series(c, points, x, y, field, style, filled) {
  if (points.length < 2) return;
  c.beginPath();
  for (const p of points) c.lineTo(x(p.t_s), y(p[field]));
  c.strokeStyle = style;
  c.lineWidth = 1.5;
  c.lineJoin = "round";
  c.stroke();
  if (!filled) return;
  c.lineTo(x(points.at(-1).t_s), y(0));
  c.lineTo(x(points[0].t_s), y(0));
  c.globalAlpha = 0.18;
  c.fillStyle = style;
  c.fill();
  c.globalAlpha = 1;
}

function budgetLine(c, width, at, style, bps) {
  c.strokeStyle = style;
  c.fillStyle = style;
  c.lineWidth = 1.5;
  c.setLineDash([6, 3]);
  c.beginPath();
  c.moveTo(LEFT, at);
  c.lineTo(width - 4, at);
  c.stroke();
  c.setLineDash([]);
  c.textAlign = "left";
  c.fillText(`budget ${rate(bps)}`, LEFT, at - 4);
}

function key(c, width, ink) {
  c.textAlign = "right";
  c.fillStyle = ink.down;
  c.fillText("down", width - 4, 10);
  c.fillStyle = ink.up;
  c.fillText("up", width - 38, 10);
}
