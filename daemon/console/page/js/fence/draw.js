// Fences and weighted areas on the map: solid in force, dashed on the way, dotted when refused; and the edited ones with
// their corners.

import { FONT, haloText } from "../canvas.js";
import { signed } from "../format.js";
import { isVoid, slotOf } from "../order/status.js";
import { store } from "../store.js";
import { areasOrder, fenceOrder, middle, pen } from "./edit.js";
import { faults, fromAreas, fromServer, nameOutline } from "./plan.js";

const DASH = { applied: [], queued: [9, 6], on_air: [9, 6], received: [9, 6], refused: [2, 5], withdrawn: [2, 5] };

export function drawOutlines(c, view, ink, vehicle, chosen) {
  const { areas, areas_in_force, fence, fence_in_force } = vehicle;
  drawOrder(c, view, ink, vehicle, chosen, { order: areasOrder, read: fromAreas, sent: areas, inForce: areas_in_force });
  drawOrder(c, view, ink, vehicle, chosen, { order: fenceOrder, read: fromServer, sent: fence, inForce: fence_in_force });
}

function drawOrder(c, view, ink, vehicle, chosen, { order, read, sent, inForce }) {
  const slot = slotOf(vehicle, order.slot);
  c.globalAlpha = chosen ? 1 : 0.55;
  if (inForce) drawPlan(c, view, ink, read(inForce.order), [], "");
  if (slot && slot.state !== "applied" && sent) {
    drawPlan(c, view, ink, read(sent), DASH[slot.state] ?? [9, 6], isVoid(slot) ? slot.state : "not in force yet");
  }
  c.globalAlpha = 1;
  if (!chosen || !pen.shown) return;
  const plan = order.value(vehicle);
  if (order.isChanged(vehicle)) drawEdited(c, view, ink, plan, read(sent));
  drawHandles(c, view, ink, plan, order);
}

/** Draws as a draft only those parts that the edit has changed. */
function drawEdited(c, view, ink, plan, sent) {
  const wrong = faults(plan);
  const known = new Set(sent.outlines.map((o) => JSON.stringify(o)));
  const changed = plan.outlines.map((o, i) => wrong.outlines[i] !== null || !known.has(JSON.stringify(o)));
  const returnPoint = JSON.stringify(plan.returnPoint) === JSON.stringify(sent.returnPoint) && !wrong.returnPoint ? null : plan.returnPoint;
  drawPlan(c, view, ink, { ...plan, returnPoint }, [4, 3], "draft", wrong, changed);
}

/** Strokes the path so that it shows on any label: a wide halo, then the tone. */
function stroke(c, ink, tone, dash, width = 2.5) {
  c.lineJoin = "round";
  for (const [style, w, d] of [[ink.sea, width + 2.5, []], [tone, width, dash]]) {
    c.strokeStyle = style;
    c.lineWidth = w;
    c.setLineDash(d);
    c.stroke();
  }
  c.setLineDash([]);
}

function drawPlan(c, view, ink, plan, dash, word, wrong = null, changed = null) {
  const tones = { fence: ink.fence, keep_out: ink.keepout, area: ink.accent };
  for (const [i, { kind, points, weight }] of plan.outlines.entries()) {
    if (points.length === 0 || changed?.[i] === false) continue;
    const tone = wrong?.outlines[i] ? ink.bad : tones[kind];
    const corners = points.map((p) => view.toScreen(...p));
    c.beginPath();
    for (const p of corners) c.lineTo(...p);
    c.closePath();
    if (kind === "keep_out") hatch(c, corners, tone);
    c.beginPath();
    for (const p of corners) c.lineTo(...p);
    c.closePath();
    stroke(c, ink, tone, dash);
    const title = nameOutline(plan, i) + (kind === "area" ? ` ${signed(weight)}` : "");
    name(c, view, ink, corners, title + (word && `, ${word}`));
  }
  if (plan.returnPoint) drawReturnPoint(c, view, ink, plan.returnPoint, wrong?.returnPoint ? ink.bad : ink.fence, word);
}

/** Hatches the path, where the vehicle must not go, without hiding the labels. */
function hatch(c, corners, tone) {
  const xs = corners.map((p) => p[0]);
  const ys = corners.map((p) => p[1]);
  const [left, right] = [Math.max(Math.min(...xs), -50), Math.min(Math.max(...xs), c.canvas.width + 50)];
  const [top, bottom] = [Math.max(Math.min(...ys), -50), Math.min(Math.max(...ys), c.canvas.height + 50)];
  c.save();
  c.clip("evenodd");
  c.beginPath();
  const gap = 9;
  for (let x = Math.floor((left - (bottom - top)) / gap) * gap; x < right; x += gap) {
    c.moveTo(x, bottom);
    c.lineTo(x + (bottom - top), top);
  }
  c.globalAlpha *= 0.65;
  c.strokeStyle = tone;
  c.lineWidth = 1.5;
  c.stroke();
  c.restore();
}

function name(c, view, ink, corners, title) {
  const [x, y] = corners.reduce((a, b) => (b[1] < a[1] - 1 || (b[1] < a[1] + 1 && b[0] < a[0]) ? b : a));
  c.font = FONT;
  const left = x > view.width - 140;
  c.textAlign = left ? "right" : "left";
  haloText(c, title, x + (left ? -8 : 8), y - 7, ink);
}

function drawReturnPoint(c, view, ink, place, tone, word) {
  const [x, y] = view.toScreen(...place);
  c.beginPath();
  c.arc(x, y, 8, 0, 2 * Math.PI);
  c.moveTo(x - 4, y);
  c.lineTo(x + 4, y);
  c.moveTo(x, y - 4);
  c.lineTo(x, y + 4);
  stroke(c, ink, tone, []);
  c.font = FONT;
  c.textAlign = "left";
  haloText(c, word ? `Return point, ${word}` : "Return point", x + 13, y + 4, ink);
}

function drawHandles(c, view, ink, plan, order) {
  for (const [i, { points }] of plan.outlines.entries()) {
    points.forEach((p, k) => {
      const [x, y] = view.toScreen(...p);
      if (points.length > 2 && pen.tool === null) dot(c, ink, view.toScreen(...middle(p, points[(k + 1) % points.length])), 3.5, ink.sea);
      const chosen = pen.order === order && pen.outline === i && pen.corner === k;
      dot(c, ink, [x, y], chosen ? 8 : 6, chosen ? ink.accent : ink.vehicle);
    });
  }
}

function dot(c, ink, [x, y], radius, fill) {
  c.beginPath();
  c.arc(x, y, radius, 0, 2 * Math.PI);
  c.fillStyle = fill;
  c.fill();
  c.lineWidth = 1.5;
  c.strokeStyle = ink.text;
  c.stroke();
}
