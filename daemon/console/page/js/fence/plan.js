// A plan: the fence, keep-outs and return point of one vehicle, as edited and as the API says them.
//
//   { outlines: [{ kind: "fence" | "keep_out", points: [[x, y], ..] }], home: [x, y] | null }   metres

import { covers, holds, MOST_KEEP_OUTS, outlineFault } from "./polygon.js";

export function fromServer(fence) {
  const outlines = (fence?.keep_outs ?? []).map((points) => ({ kind: "keep_out", points }));
  if (fence?.fence) outlines.unshift({ kind: "fence", points: fence.fence });
  return { outlines, home: fence?.return_point ?? null };
}

export function toOrder({ outlines, home }) {
  const order = { keep_outs: outlines.filter((o) => o.kind === "keep_out").map((o) => o.points) };
  const fence = outlines.find((o) => o.kind === "fence");
  if (fence) order.fence = fence.points;
  if (home) order.return_point = home;
  return order;
}

export function nameOutline({ outlines }, i) {
  if (outlines[i].kind === "fence") return "Fence";
  return `Keep-out ${outlines.slice(0, i + 1).filter((o) => o.kind === "keep_out").length}`;
}

/** What is wrong, beside what: a line or null for each outline, and for the return point. */
export function faults({ outlines, home }) {
  const fence = outlines.find((o) => o.kind === "fence");
  const own = outlines.map((o) => outlineFault(o.points));
  const sound = outlines.filter((_, i) => own[i] === null);
  const of = outlines.map((o, i) => {
    if (own[i]) return own[i];
    if (o.kind === "keep_out" && sound.includes(fence) && covers(o.points, fence.points)) return "It leaves nothing of the fence";
    const before = outlines.slice(0, i).filter((x) => x.kind === "keep_out").length;
    return o.kind === "keep_out" && before >= MOST_KEEP_OUTS ? `More than ${MOST_KEEP_OUTS} keep-outs` : null;
  });
  return { outlines: of, home: home ? homeFault(sound, home) : null };
}

function homeFault(sound, home) {
  if (!home.every((m) => Math.abs(m) <= 838860.7)) return "It is not a place within 838 km";
  const bad = sound.find((o) => holds(o.points, home) !== (o.kind === "fence"));
  if (!bad) return null;
  return bad.kind === "fence" ? "It lies outside the fence" : "It lies in a keep-out";
}

export const isSound = (plan) => {
  const { outlines, home } = faults(plan);
  return home === null && outlines.every((f) => f === null);
};
