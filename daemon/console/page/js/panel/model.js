// How the vehicle builds its map and how finely it tells it: typed, or picked to fit a budget.

import { readFit, sendSettings } from "../api.js";
import { $, h, show, text } from "../dom.js";
import { metres, rate } from "../format.js";
import { store } from "../store.js";
import { Order, orderFoot } from "./order.js";
import { order as plannerOrder } from "./planner.js";

const NUMBERS = [
  ["alpha", "Alpha", "Preference for labels that are used elsewhere", 1e-9, 1e3],
  ["beta", "Beta", "Prior weight of each word in a label", 1e-9, 1e3],
  ["gamma", "Gamma", "Weight of a new label", 1e-12, 1e3],
  ["refine_words_per_s", "Refine, words/s", "Words resampled a second of mission time", 1, 1e8],
  ["frames_per_s", "Frames, 1/s", "Camera frames a second that the scene model sees at most", 0.01, 30],
];
const SIDE = 4;
const CELLS = { fine: (m) => `all, ${m(1)}`, "coarse-to-fine": (m) => `${m(SIDE)} first, then ${m(1)}`, coarse: (m) => `every fourth, ${m(SIDE)}` };
const KINDS = ["confidence", "depth", "curiosity"];
const SETS = [...Array(2 ** KINDS.length).keys()].map((bits) => KINDS.filter((_, i) => (bits >> i) & 1)).sort((a, b) => a.length - b.length);
const PLANES = Object.fromEntries(SETS.map((set) => [set.join() || "none", [set.slice(0, -1).join(", "), set.at(-1)].filter(Boolean).join(" and ") || "none"]));
const KEYS = [...NUMBERS.map(([key]) => key), "cells", "planes"];
const MOST_BPS = 1e7;
const AS_IS = "as it is";
const CONFIGURED = "as configured";

const read = (v) => Object.fromEntries(KEYS.map((k) => [k, v.settings?.asked[k] ?? null]));
const stated = (settings) => Object.fromEntries(Object.entries(settings).filter(([, value]) => value !== null));
export const order = new Order("settings", read, (v, settings) => sendSettings(v.id, stated(settings)));
// The planner goes in the same slot: an order of this page is not another console's.
order.ours = plannerOrder.ours;

/** What is wrong with a number; null if nothing. Nothing stays as it is, 0 is as configured. */
export function numberFault(value, low, high) {
  if (value === null || value === 0) return null;
  return Number.isFinite(value) && value >= low && value <= high ? null : `It takes ${low} to ${high}, or 0 ${CONFIGURED}`;
}

const foot = orderFoot(order, "Settings", "send-settings");
const lines = [...NUMBERS.map(numberLine), choiceLine("cells", "Cells told", "Which cells of its map the vehicle tells; those of its model stay"), choiceLine("planes", "Planes", "What it tells beside the labels")];
const limit = h("input", { type: "number", id: "fit-bps", min: 1, max: MOST_BPS, step: "any", oninput: () => forget(), onkeydown: (event) => event.key === "Enter" && pick() });
const fit = h("button", { type: "button", id: "fit", onclick: pick }, "Fit to budget");
const fitted = h("p.note", { id: "fitted", role: "status" });
const fitError = h("p.error", { role: "alert" });
let asked = null;

export function startModel() {
  $("model").append(h("header", {}, h("h2", { id: "model-title" }, "Scene model")), h("div.part", {},
    h("p.hint", {}, `A field that is empty stays ${AS_IS} on the vehicle; 0 is ${CONFIGURED} there. Labels keep their meaning.`),
    ...lines.map((l) => l.node),
    h("div.fit", { role: "group", "aria-label": "Fit to budget" }, h("label", { for: "fit-bps" }, "Map stream, bit/s"), limit, fit), fitted, fitError, foot.node));
  store.on("state select draft feed tab", update);
  store.on("select", forget);
}

function set(key, value) {
  order.set(store.vehicle, { ...order.value(store.vehicle), [key]: value });
}

/** A value in force, in words. */
function inForce(key) {
  const known = store.vehicle.settings?.in_force;
  if (!known) return "not known";
  const value = known[key] ?? null;
  if (value === null) return "not set from here";
  return value === 0 || value === "" ? CONFIGURED : key === "planes" ? PLANES[value] : key === "cells" ? value.replaceAll("-", " ") : String(value);
}

/** What is in force is told where it is not what the field says. */
function refreshForce(node, key, value) {
  const words = inForce(key);
  const told = store.vehicle.settings?.in_force?.[key] ?? null;
  show(node, words === "not known" ? value !== null : told !== value);
  text(node, `In force: ${words}`);
}

function numberLine([key, name, hint, low, high]) {
  const fault = h("p.error", { id: `${key}-fault`, role: "alert" });
  const force = h("p.note");
  const input = h("input", { type: "number", id: `set-${key}`, min: 0, step: "any", oninput: () => set(key, typed()) });
  const node = h("div.limit", { title: hint }, h("label.way", { for: input.id }, name), input, fault, force);
  const typed = () => {
    if (input.validity.badInput) return NaN;
    if (input.value !== "") return input.valueAsNumber;
    return read(store.vehicle)[key] === null ? null : 0;
  };
  const update = (value) => {
    if (document.activeElement !== input) input.value = value === null || value === 0 || Number.isNaN(value) ? "" : value;
    input.placeholder = value === 0 ? CONFIGURED : AS_IS;
    const wrong = numberFault(value, low, high);
    show(fault, wrong !== null);
    text(fault, wrong ?? "");
    input.setAttribute("aria-describedby", fault.id);
    input.setAttribute("aria-invalid", String(wrong !== null));
    refreshForce(force, key, value);
    return wrong === null;
  };
  return { key, node, update };
}

function choiceLine(key, name, hint) {
  const values = Object.keys(key === "cells" ? CELLS : PLANES);
  const options = [["-", AS_IS], ["", CONFIGURED], ...values.map((v) => [v, v])].map(([value, words]) => h("option", { value }, words));
  const pick = h("select", { id: `set-${key}`, onchange: () => set(key, pick.value === "-" ? null : pick.value) }, ...options);
  const force = h("p.note");
  const node = h("div.limit", { title: hint }, h("label.way", { for: pick.id }, name), pick, force);
  const update = (value) => {
    const size = (cells) => metres(cells * store.vehicle.map.cell_m, 2);
    values.forEach((v, i) => text(options[i + 2], key === "cells" ? CELLS[v](size) : PLANES[v]));
    pick.value = value ?? "-";
    refreshForce(force, key, value);
    return true;
  };
  return { key, node, update };
}

function forget() {
  asked = null;
  text(fitted, "");
  text(fitError, "");
}

/** Fills the fields with what tells most within the budget, and says what that gives up; sending is left to the operator. */
async function pick() {
  forget();
  const vehicle = store.vehicle;
  const bps = limit.value === "" ? null : limit.valueAsNumber;
  if (limit.validity.badInput || (bps !== null && !(bps >= 1 && bps <= MOST_BPS))) {
    text(fitError, `It takes 1 to ${MOST_BPS} bit/s, or nothing for the map's share of the budget`);
    return;
  }
  const mine = (asked = {});
  try {
    const found = await readFit(vehicle.id, bps);
    if (asked !== mine) return;
    const share = bps === null ? ", the map's share," : "";
    if (found.chosen === null) {
      text(fitError, found.given_up);
      return;
    }
    text(fitted, `For ${rate(found.bits_per_s)}${share} a stream of ${rate(found.chosen.stream_bps)}. ${sentence(found.given_up)}`);
    order.set(vehicle, { ...order.value(vehicle), ...stated(found.chosen.settings) });
  } catch (problem) {
    if (asked === mine) text(fitError, problem.message);
  }
}

const sentence = (words) => `${words[0].toUpperCase()}${words.slice(1)}.`;

function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const unsent = order.changed(vehicle);
  $("tab-model").classList.toggle("unsent", unsent);
  $("tab-model").title = unsent ? "Edits that were not sent" : "";
  if (document.body.dataset.tab !== "model") return;
  const value = order.value(vehicle);
  const sound = lines.map((l) => l.update(value[l.key])).every(Boolean);
  const { budget_bps: ours, shares } = store.snapshot.link;
  const budget = vehicle.status?.budget_bps ?? ours;
  limit.placeholder = shares ? `${Math.round((budget * shares.map) / 100)}: its share` : "its share";
  fit.disabled = !store.connected;
  foot.update(vehicle, !sound);
}
