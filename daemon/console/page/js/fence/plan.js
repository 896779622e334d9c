// A plan: outlines on the map, and their form in the API. One has the fence, the keep-outs and the return point of a vehicle,
// another its weighted areas.
//
//   { outlines: [{ kind: "fence" | "keep_out" | "area", points: [[x, y], ..], weight }], returnPoint: [x, y] | null }
//   metres in the world; only an area has a weight, and only the first plan a return point

import { areaOf, covers, distanceTo, holds, MAX_DISTANCE_M, MAX_KEEP_OUTS, outlineFault } from "./polygon.js";

export function fromServer(fence) {
  const outlines = (fence?.keep_outs ?? []).map((points) => ({ kind: "keep_out", points }));
  if (fence?.fence) outlines.unshift({ kind: "fence", points: fence.fence });
  return { outlines, returnPoint: fence?.return_point ?? null };
}

/** The whole order: a member that is null removes what is in force. */
export const toOrder = ({ outlines, returnPoint }) => ({
  fence: fenceOf({ outlines })?.points ?? null,
  keep_outs: outlines.filter((o) => o.kind === "keep_out").map((o) => o.points),
  return_point: returnPoint,
});

const fenceOf = ({ outlines }) => outlines.find((o) => o.kind === "fence") ?? null;

/**
 * What a sound plan with a fence means for a vehicle at `at`: the area inside in square metres, the number of the `cells` (centres in the
 * world) that it cuts off, whether the vehicle is inside, and the distance from the vehicle to the nearest edge. Null without a fence.
 */
export function consequences(plan, cells, at) {
  const fence = fenceOf(plan);
  if (!fence) return null;
  const allows = (place) => plan.outlines.every((o) => o.kind === "area" || holds(o.points, place) === (o.kind === "fence"));
  return {
    area: areaOf(fence.points),
    cut: cells.filter((cell) => !allows(cell)).length,
    isInside: at === null || allows(at),
    distance: at && Math.min(...plan.outlines.map((o) => distanceTo(o.points, at))),
  };
}

/** The plan of weighted areas. */
export const fromAreas = (order) => ({
  outlines: (order?.areas ?? []).map(({ outline, weight }) => ({ kind: "area", points: outline, weight })),
  returnPoint: null,
});

export const toAreas = ({ outlines }) => outlines.map(({ points, weight }) => ({ outline: points, weight }));

export function nameOutline({ outlines }, i) {
  if (outlines[i].kind === "fence") return "Fence";
  if (outlines[i].kind === "area") return `Area ${i + 1}`;
  return `Keep-out ${outlines.slice(0, i + 1).filter((o) => o.kind === "keep_out").length}`;
}

/** The fault of each outline and of the return point: one line, or null. */
export function faults({ outlines, returnPoint }) {
  const fence = fenceOf({ outlines });
  const own = outlines.map((o) => outlineFault(o.points));
  const sound = outlines.filter((_, i) => own[i] === null);
  const of = outlines.map((o, i) => {
    if (own[i]) return own[i];
    if (o.kind === "keep_out" && sound.includes(fence) && covers(o.points, fence.points)) return "It covers the whole fence";
    const before = outlines.slice(0, i).filter((x) => x.kind === "keep_out").length;
    return o.kind === "keep_out" && before >= MAX_KEEP_OUTS ? `More than ${MAX_KEEP_OUTS} keep-outs` : null;
  });
  return { outlines: of, returnPoint: returnPoint ? returnPointFault(sound, returnPoint) : null };
}

function returnPointFault(sound, place) {
  if (!place.every((m) => Math.abs(m) <= MAX_DISTANCE_M)) return `It is farther than ${MAX_DISTANCE_M / 1000} km from the origin`;
  const bad = sound.find((o) => holds(o.points, place) !== (o.kind === "fence"));
  if (!bad) return null;
  return bad.kind === "fence" ? "It lies outside the fence" : "It lies in a keep-out";
}

export const isSound = (plan) => {
  const { outlines, returnPoint } = faults(plan);
  return returnPoint === null && outlines.every((f) => f === null);
};
