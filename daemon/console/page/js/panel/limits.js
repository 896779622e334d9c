// Bands of depth and altitude, limits of distance, time and silence, and the reactions of the vehicle.

import { sendLimits } from "../api.js";
import { h, show, text } from "../dom.js";
import { orderFoot } from "../order/foot.js";
import { Order } from "../order/order.js";
import { slotOf } from "../order/status.js";
import { store } from "../store.js";

const MAX_AMOUNT = 0xffffff;
const MAX_DEPTH_M = 6553.5;
const BANDS = [
  ["depth_m", "Depth, m", "Depth below the surface"],
  ["altitude_m", "Altitude, m", "Height above the sea floor"],
];
const AMOUNTS = [
  ["distance_m", "Distance, m", "Distance over ground, including the return path", MAX_AMOUNT],
  ["time_s", "Time, s", "Duration of the survey, including the return path", MAX_AMOUNT],
  ["silence_s", "Silence, s", "Longest time without a frame from the surface", 65535],
];
const REACTIONS = [
  ["on_silence", "On silence", "What the vehicle does after the time in Silence without a frame from the surface"],
  ["on_breach", "On a breach", "What the vehicle does once it has left the fence, a band or a limit"],
  ["on_abort", "On abort", "What the vehicle does when an abort is in force"],
];

const NAMES = Object.fromEntries([...BANDS, ...AMOUNTS, ...REACTIONS].map(([key, name]) => [key, name.toLowerCase()]));
const KEYS = [...BANDS, ...AMOUNTS, ...REACTIONS].map(([key]) => key);
const read = (v) => Object.fromEntries(KEYS.map((k) => [k, v.limits?.[k] ?? null]));
const stated = (limits) => Object.fromEntries(Object.entries(limits).filter(([, value]) => value !== null));
export const limitsOrder = new Order("limits", read, (v, value) => sendLimits(v.id, value()));

/** The fault of a band [low, high], or null. */
export function bandFault(band) {
  if (band === null) return null;
  const [low, high] = band;
  if (low === null || high === null) return "Give both bounds, or neither";
  if (![low, high].every((m) => m >= 0 && m <= MAX_DEPTH_M)) return `The range is 0 to ${MAX_DEPTH_M} m`;
  return Math.round(low * 10) < Math.round(high * 10) ? null : "The lowest must be below the highest";
}

export function amountFault(value, max) {
  if (value === null) return null;
  return Number.isInteger(value) && value >= 1 && value <= max ? null : `The range is 1 to ${max}, whole numbers`;
}

const state = h("p.note");
const foot = orderFoot(limitsOrder, "Limits", "send-limits");
const lines = [...BANDS.map(bandLine), ...AMOUNTS.map(amountLine)];
const choices = REACTIONS.map(reactionLine);
export const limitsPart = h("section.part", { "aria-labelledby": "limits-title" },
  h("h3", { id: "limits-title" }, "Limits"), state, h("p.hint", {}, "An empty field means no limit."),
  ...lines.map((l) => l.node), ...choices.map((l) => l.node), foot.node);

function set(key, value) {
  limitsOrder.set(store.vehicle, { ...limitsOrder.value(store.vehicle), [key]: value });
}

/** A field's number; null if it is empty, "?" if it holds anything else. */
const number = (input) => (input.validity.badInput ? "?" : input.value === "" ? null : input.valueAsNumber);

function line(key, name, hint, inputs, faultOf) {
  const fault = h("p.error", { id: `${key}-fault`, role: "alert" });
  const node = h("div.limit", inputs.length > 1 ? { title: hint, role: "group", "aria-label": name } : { title: hint }, h("span.caption", {}, name), h("span.inputs", {}, ...inputs), fault);
  const update = (value) => {
    const wrong = faultOf(value);
    show(fault, wrong !== null);
    text(fault, wrong ?? "");
    for (const i of inputs.filter((x) => x.matches?.("input"))) {
      i.setAttribute("aria-describedby", fault.id);
      i.setAttribute("aria-invalid", String(wrong !== null));
    }
    return wrong === null;
  };
  return { node, update };
}

const fill = (input, value) => {
  if (document.activeElement !== input && input.value !== String(value ?? "")) input.value = value ?? "";
};

function bandLine([key, name, hint]) {
  const ends = ["lowest", "highest"].map((end) => h("input", { type: "number", min: 0, step: 0.1, "aria-label": `${name}, ${end}`, oninput: readEnds }));
  function readEnds() {
    const band = ends.map(number);
    set(key, band.every((v) => v === null) ? null : band);
  }
  const l = line(key, name, hint, [ends[0], "to", ends[1]], bandFault);
  return { node: l.node, update(limits) {
    ends.forEach((input, i) => fill(input, limits[key]?.[i]));
    return l.update(limits[key]);
  } };
}

function amountLine([key, name, hint, max]) {
  const input = h("input", { type: "number", min: 1, max, step: 1, "aria-label": name, oninput: () => set(key, number(input)) });
  const l = line(key, name, hint, [input], (v) => amountFault(v, max));
  return { node: l.node, update(limits) {
    fill(input, limits[key]);
    return l.update(limits[key]);
  } };
}

function reactionLine([key, name, hint]) {
  const pick = h("select", { onchange: () => set(key, pick.value || null) },
    h("option", { value: "" }, "the vehicle's default"), ...["hold", "return", "surface"].map((r) => h("option", { value: r }, r)));
  const node = h("label.limit", { title: hint }, h("span.caption", {}, name), pick);
  return { node, update: (limits) => (pick.value = limits[key] ?? "") };
}

/** The limits in force, as far as the surface knows. */
function describeInForce(vehicle) {
  const slot = slotOf(vehicle, "limits");
  const before = vehicle.limits_in_force;
  const list = () => Object.entries(stated(before.order)).map(([key, value]) => `${NAMES[key]} ${value.join?.(" to ") ?? value}`).join("; ") || "no limits";
  if (!slot || slot.state === "applied") {
    if (vehicle.in_force.limits === "none") return "The vehicle reports that no limits are in force beside the configured ones.";
    if (vehicle.in_force.limits === "unknown") return "In force, unknown here: the vehicle has limits that this surface has not sent. The surface asks for them.";
    if (!before) return "The vehicle has not reported yet whether limits are in force.";
    return before.version === 0 ? `In force, sent by another surface or before its files were lost: ${list()}.` : "In force as last sent.";
  }
  if (!before) return "This surface does not know which limits are in force meanwhile.";
  return `In force meanwhile: version ${before.version}: ${list()}.`;
}

export function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const limits = limitsOrder.value(vehicle);
  const sound = lines.map((l) => l.update(limits)).every(Boolean);
  for (const c of choices) c.update(limits);
  text(state, describeInForce(vehicle));
  foot.update(vehicle, !sound);
}
