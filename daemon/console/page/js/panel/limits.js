// Bands of depth and altitude, limits of distance, time and silence, and what the vehicle does at them.

import { sendLimits } from "../api.js";
import { h, show, text } from "../dom.js";
import { store } from "../store.js";
import { slotOf } from "./lifeline.js";
import { Order, orderFoot } from "./order.js";

const MOST = 0xffffff;
const MOST_DEPTH_M = 6553.5;
const BANDS = [
  ["depth_m", "Depth, m", "Depth below the surface"],
  ["altitude_m", "Altitude, m", "Height above the sea floor"],
];
const AMOUNTS = [
  ["distance_m", "Distance, m", "Way over ground, the way back included", MOST],
  ["time_s", "Time, s", "Length of the survey, the way back included", MOST],
  ["silence_s", "Silence, s", "Without a frame of the surface", 65535],
];
const REACTIONS = [["on_silence", "On silence"], ["on_breach", "On a breach"], ["on_abort", "On abort"]];

const WORDS = Object.fromEntries([...BANDS, ...AMOUNTS, ...REACTIONS].map(([key, name]) => [key, name.toLowerCase()]));
const KEYS = [...BANDS, ...AMOUNTS, ...REACTIONS].map(([key]) => key);
const read = (v) => Object.fromEntries(KEYS.map((k) => [k, v.limits?.[k] ?? null]));
const stated = (limits) => Object.fromEntries(Object.entries(limits).filter(([, value]) => value !== null));
export const limitsOrder = new Order("limits", read, (v, limits) => sendLimits(v.id, stated(limits)));

/** What is wrong with a band [low, high]; null if nothing. */
export function bandFault(band) {
  if (band === null) return null;
  const [low, high] = band;
  if (low === null || high === null) return "Give both ends, or neither";
  if (![low, high].every((m) => m >= 0 && m <= MOST_DEPTH_M)) return `It takes 0 to ${MOST_DEPTH_M} m`;
  return Math.round(low * 10) < Math.round(high * 10) ? null : "The lowest must be below the highest";
}

export function amountFault(value, most) {
  if (value === null) return null;
  return Number.isInteger(value) && value >= 1 && value <= most ? null : `It takes whole numbers from 1 to ${most}`;
}

const state = h("p.note");
const foot = orderFoot(limitsOrder, "Limits", "send-limits");
const lines = [...BANDS.map(bandLine), ...AMOUNTS.map(amountLine)];
const choices = REACTIONS.map(reactionLine);
export const limitsPart = h("section.part", { "aria-labelledby": "limits-title" },
  h("h3", { id: "limits-title" }, "Limits"), state, h("p.hint", {}, "An empty field is no limit."),
  ...lines.map((l) => l.node), ...choices.map((l) => l.node), foot.node);

function set(key, value) {
  limitsOrder.set(store.vehicle, { ...limitsOrder.value(store.vehicle), [key]: value });
}

/** A field's number; null if it is empty, "?" if it holds anything else. */
const number = (input) => (input.validity.badInput ? "?" : input.value === "" ? null : input.valueAsNumber);

function line(key, name, hint, inputs, faultOf) {
  const fault = h("p.error", { id: `${key}-fault`, role: "alert" });
  const node = h("div.limit", inputs.length > 1 ? { title: hint, role: "group", "aria-label": name } : { title: hint }, h("span.way", {}, name), h("span.inputs", {}, ...inputs), fault);
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
  const ends = ["lowest", "highest"].map((end) => h("input", { type: "number", min: 0, step: 0.1, "aria-label": `${name}, ${end}`, oninput: said }));
  function said() {
    const band = ends.map(number);
    set(key, band.every((v) => v === null) ? null : band);
  }
  const l = line(key, name, hint, [ends[0], "to", ends[1]], bandFault);
  return { node: l.node, update(limits) {
    ends.forEach((input, i) => fill(input, limits[key]?.[i]));
    return l.update(limits[key]);
  } };
}

function amountLine([key, name, hint, most]) {
  const input = h("input", { type: "number", min: 1, max: most, step: 1, "aria-label": name, oninput: () => set(key, number(input)) });
  const l = line(key, name, hint, [input], (v) => amountFault(v, most));
  return { node: l.node, update(limits) {
    fill(input, limits[key]);
    return l.update(limits[key]);
  } };
}

function reactionLine([key, name]) {
  const pick = h("select", { onchange: () => set(key, pick.value || null) },
    h("option", { value: "" }, "as configured there"), ...["hold", "return", "surface"].map((r) => h("option", { value: r }, r)));
  const node = h("label.limit", {}, h("span.way", {}, name), pick);
  return { node, update: (limits) => (pick.value = limits[key] ?? "") };
}

/** What holds now, as far as the surface knows. */
function describe(vehicle) {
  const slot = slotOf(vehicle, "limits");
  if (!slot) return "None were sent since the surface started; the vehicle keeps what it has.";
  if (slot.state === "applied") return "In force as sent last.";
  const before = vehicle.limits_in_force;
  if (!before) return "Which ones are in force meanwhile is not known here.";
  const words = Object.entries(stated(before.order)).map(([key, value]) => `${WORDS[key]} ${value.join?.(" to ") ?? value}`);
  return `In force meanwhile: version ${before.version}: ${words.join("; ") || "no limits"}.`;
}

export function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const limits = limitsOrder.value(vehicle);
  const sound = lines.map((l) => l.update(limits)).every(Boolean);
  for (const c of choices) c.update(limits);
  text(state, describe(vehicle));
  foot.update(vehicle, !sound);
}
