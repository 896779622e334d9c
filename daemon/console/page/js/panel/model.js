// How the vehicle builds its map and which cells and layers it sends: typed, or fitted to a budget.

import { readFit, sendSettings } from "../api.js";
import { lockInRecord } from "../command.js";
import { $, h, show, text } from "../dom.js";
import { metres, rate } from "../format.js";
import { orderFoot } from "../order/foot.js";
import { Order } from "../order/order.js";
import { store } from "../store.js";
import { order as plannerOrder } from "./planner.js";

const NUMBERS = [
  ["labels", "Labels, at most", "Most labels that the map tells apart, where labels are habitats; those that look most alike become one", 2, 32],
  ["alpha", "Alpha", "Preference for topics that are used elsewhere; of effect on the labels only where these are topics", 1e-9, 1e3],
  ["beta", "Beta", "Prior weight of each word in a topic; of effect on the labels only where these are topics", 1e-9, 1e3],
  ["gamma", "Gamma", "Weight of a new topic; of effect on the labels only where these are topics", 1e-12, 1e3],
  ["refine_words_per_s", "Refine, words/s", "Words resampled per second of mission time", 1, 1e8],
  ["frames_per_s", "Frames, 1/s", "Maximum rate of camera frames into the scene model", 0.01, 30],
];
const SIDE = 4;
const CELLS = { fine: (m) => `all, ${m(1)}`, "coarse-to-fine": (m) => `${m(SIDE)} first, then ${m(1)}`, coarse: (m) => `every fourth, ${m(SIDE)}` };
const REGISTRATION = { on: "on: by their overlap", off: "off: by odometry and compass" };
const KEYS = [...NUMBERS.map(([key]) => key), "cells", "layers", "registration"];
const MAX_BPS = 1e7;
const UNCHANGED = "unchanged";
const DEFAULT = "the vehicle's default";

const read = (v) => Object.fromEntries(KEYS.map((k) => [k, v.settings?.requested[k] ?? null]));
const stated = (settings) => Object.fromEntries(Object.entries(settings).filter(([, value]) => value !== null));
// The planner uses the same slot, so both orders share the list of versions that this page sent.
export const order = new Order("settings", read, (v, value) => sendSettings(v.id, stated(value())), plannerOrder.sentVersions);

/** The fault of a number, or null. Null leaves the setting unchanged, 0 means the default. */
export function numberFault(value, low, high) {
  if (value === null || value === 0) return null;
  return Number.isFinite(value) && value >= low && value <= high ? null : `The range is ${low} to ${high}, or 0 for ${DEFAULT}`;
}

const foot = orderFoot(order, "Settings", "send-settings");
const lines = [...NUMBERS.map(numberLine), choiceLine("cells", "Cells sent", "Cells of the vehicle's map that it sends; the cells of its scene model do not change"), choiceLine("layers", "Layers sent", "Layers that the vehicle sends in addition to the labels"), choiceLine("registration", "Frames placed", "Whether the overlap of camera frames with earlier ones places them on the map; switch it off where the map bends")];
const limit = h("input", { type: "number", id: "fit-bps", min: 1, max: MAX_BPS, step: "any", oninput: () => forget(), onkeydown: (event) => event.key === "Enter" && pick() });
const fit = h("button", { type: "button", id: "fit", onclick: pick }, "Fit to budget");
const fitted = h("p.note", { id: "fitted", role: "status" });
const fitErrorLine = h("p.error", { role: "alert" });
let pendingFit = null;

export function startModel() {
  $("model").append(h("header", {}, h("h2", { id: "model-title" }, "Scene model")), h("div.part", {},
    h("p.hint", {}, `An empty field leaves the setting unchanged; 0 means ${DEFAULT}. Labels keep their meaning.`),
    ...lines.map((l) => l.node),
    h("div.fit", { role: "group", "aria-label": "Fit to budget" }, h("label", { for: "fit-bps", title: "Bits a second that changes of the map may take on the mean" }, "Map stream, bit/s"), limit, fit), fitted, fitErrorLine, foot.node));
  store.on("state select edit feed tab", update);
  store.on("select", forget);
}

function set(key, value) {
  order.set(store.vehicle, { ...order.value(store.vehicle), [key]: value });
}

/** The text of a value in force. */
function inForce(key) {
  const known = store.vehicle.settings?.in_force;
  if (!known) return "unknown";
  const value = known[key] ?? null;
  if (value === null) return "not set by this surface";
  return value === 0 || value === "" ? DEFAULT : key === "layers" ? layersText(value) : key === "cells" ? value.replaceAll("-", " ") : String(value);
}

/** Shows the value in force where it differs from the field. */
function refreshForce(node, key, value) {
  const words = inForce(key);
  const known = store.vehicle.settings?.in_force?.[key] ?? null;
  show(node, words === "unknown" ? value !== null : known !== value);
  text(node, `In force: ${words}`);
}

function numberLine([key, name, hint, low, high]) {
  const fault = h("p.error", { id: `${key}-fault`, role: "alert" });
  const force = h("p.note");
  const input = h("input", { type: "number", id: `set-${key}`, min: 0, step: "any", oninput: () => set(key, typed()) });
  const node = h("div.limit", { title: hint }, h("label.caption", { for: input.id }, name), input, fault, force);
  const typed = () => {
    if (input.validity.badInput) return NaN;
    if (input.value !== "") return input.valueAsNumber;
    return read(store.vehicle)[key] === null ? null : 0;
  };
  const update = (value) => {
    if (document.activeElement !== input) input.value = value === null || value === 0 || Number.isNaN(value) ? "" : value;
    input.placeholder = value === 0 ? DEFAULT : UNCHANGED;
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

/** Text of a set of layers: names with commas between, or none. */
const layersText = (names) => names.split(",").join(", ").replace(/, ([^,]*)$/, " and $1");

/** Sets of layers to choose from: none, each, each two, all, and the one that is set. */
function layerSets(value) {
  const names = store.snapshot?.layers.map((l) => l.name) ?? [];
  const pairs = names.flatMap((a, i) => names.slice(i + 1).map((b) => `${a},${b}`));
  return [...new Set(["none", ...names, ...pairs, names.join(), ...(value ? [value] : [])].filter(Boolean))];
}

function choiceLine(key, name, hint) {
  const pick = h("select", { id: `set-${key}`, onchange: () => set(key, pick.value === "-" ? null : pick.value) });
  const force = h("p.note");
  const node = h("div.limit", { title: hint }, h("label.caption", { for: pick.id }, name), pick, force);
  const update = (value) => {
    const size = (cells) => metres(cells * store.vehicle.map.cell_m, 2);
    const choices = {
      cells: () => Object.entries(CELLS).map(([v, of]) => [v, of(size)]),
      layers: () => layerSets(value).map((v) => [v, layersText(v)]),
      registration: () => Object.entries(REGISTRATION),
    }[key]();
    const options = [["-", UNCHANGED], ["", DEFAULT], ...choices];
    if (pick.dataset.key !== options.join()) {
      pick.dataset.key = options.join();
      pick.replaceChildren(...options.map(([value, words]) => h("option", { value }, words)));
    }
    pick.value = value ?? "-";
    refreshForce(force, key, value);
    return true;
  };
  return { key, node, update };
}

function forget() {
  pendingFit = null;
  text(fitted, "");
  text(fitErrorLine, "");
}

/** Fills the fields with the most informative settings within the budget and names the trade-off; the operator sends them. */
async function pick() {
  forget();
  const vehicle = store.vehicle;
  const bps = limit.value === "" ? null : limit.valueAsNumber;
  if (limit.validity.badInput || (bps !== null && !(bps >= 1 && bps <= MAX_BPS))) {
    text(fitErrorLine, `The range is 1 to ${MAX_BPS} bit/s; leave it empty for the map's share of the budget`);
    return;
  }
  const request = (pendingFit = {});
  try {
    const found = await readFit(vehicle.id, bps);
    if (pendingFit !== request) return;
    const share = bps === null ? ", the map's share," : "";
    if (found.chosen === null) {
      text(fitErrorLine, found.trade_off);
      return;
    }
    text(fitted, `For ${rate(found.bits_per_s)}${share} a stream of ${rate(found.chosen.stream_bps)}. ${sentence(found.trade_off)}`);
    order.set(vehicle, { ...order.value(vehicle), ...stated(found.chosen.settings) });
  } catch (error) {
    if (pendingFit === request) text(fitErrorLine, error.message);
  }
}

const sentence = (words) => `${words[0].toUpperCase()}${words.slice(1)}.`;

function update() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const unsent = order.isChanged(vehicle);
  $("tab-model").classList.toggle("unsent", unsent);
  $("tab-model").title = unsent ? "Edits that are not sent" : "";
  if (document.body.dataset.tab !== "model") return;
  const value = order.value(vehicle);
  const sound = lines.map((l) => l.update(value[l.key])).every(Boolean);
  const { budget_bps: surfaceBudget, shares } = store.snapshot.link;
  const budget = vehicle.status?.budget_bps ?? surfaceBudget;
  limit.placeholder = `${Math.round((budget * shares.map) / 100)}: its share`;
  fit.disabled = !store.connected;
  foot.update(vehicle, !sound);
  lockInRecord($("model"));
}
