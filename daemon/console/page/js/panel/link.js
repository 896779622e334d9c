// The acoustic link: rates and budget, bits by class, loss, delay, backlog.

import { $, h, row, text } from "../dom.js";
import { ago, bits, count, joules, none, percent, rate, span } from "../format.js";
import { ageOf, isSilent, isStale, store } from "../store.js";
import { budgetParts, refreshBudget } from "./budget.js";
import { classHelp } from "./class-help.js";
import { drawHistory } from "./history.js";

const CLASSES = ["status", "directive", "fix", "exemplar", "overhead"];
/** The map, the layers that the surface lists or has received, and all other classes. */
function classNames(link) {
  const layers = [...store.snapshot.layers.map((l) => l.name), ...Object.keys(link.up.bytes_by_class)];
  return [...new Set(["map", ...layers.filter((c) => c !== "map" && !CLASSES.includes(c)).sort(), ...CLASSES])];
}
const classLine = (c) => h("tr", { data: { class: c }, title: classHelp(c) }, h("th", { scope: "row" }, c), h("td"), h("td", {}, h("span.share", {}, h("span"))), h("td"));
const COLUMNS = [
  ["Class", "Kind of data in the frames"],
  ["Up", "Bits from the vehicle to the surface"],
  ["Share", "Its part of all bits from the vehicle"],
  ["Down", "Bits from the surface to the vehicle"],
];
const directions = { up: direction("Up", "vehicle to surface"), down: direction("Down", "surface to vehicle") };
const LINES = [
  ["loss", "Frames lost, up / down", "Share of the frames that were lost or damaged since the start, from all vehicles and to them"],
  ["recent", "Recent loss, up / down", "The same share among the last frames from this vehicle and to it"],
  ["refused", "Refused, vehicle / surface", "Frames without a valid tag, where a key is set"],
  ["own", "Vehicle's budget", "The bit budget that the vehicle keeps to, by its last report"],
  ["goodput", "Goodput, up / down", "The rate of payload that arrived and was useful"],
  ["energy", "Energy, up / down", "Electrical energy of the modems for all frames since the start; that of the vehicles is estimated from the frames received and the loss"],
  ["mapEnergy", "Energy per map bit", "Energy of the vehicles' frames for each bit of the map received"],
  ["trip", "Round trip", "Time that sound takes to the vehicle and back, as measured"],
  ["backlog", "Backlog", "The bits that the vehicle still has to send: those of its last report, minus the bits received since. The survey continues meanwhile."],
  ["lag", "Map lag", "How far this map is behind the vehicle's: its approximate age and the missing bits"],
];
/** Loss while no frame comes in. */
const UNKNOWN = "not known";
const history = h("canvas", { role: "img" });
const values = {};
/** Rows with reports of the selected vehicle or measurements of it: grey while it is silent. */
const ofVehicle = [];
const list = h("dl.values");
const classes = h("table.classes");
const age = h("p.age");

function direction(name, title) {
  const bar = h("span.bar", {}, h("span.now"), h("span.max", { title: "Highest rate over one window" }));
  const now = h("b.rate");
  const max = h("span.max-text");
  return { node: h("div.direction", { title }, h("span.caption", {}, name), bar, now, max), bar, now, max };
}

export function startLink() {
  for (const [key, name, hint] of LINES) {
    const [node, set] = row(name, hint);
    values[key] = set;
    node.classList.toggle("whole", key === "backlog" || key === "lag");
    if (["recent", "own", "backlog", "lag"].includes(key)) ofVehicle.push(node);
    list.append(node);
  }
  classes.append(h("caption", {}, "Bits by class since the start"), h("thead", {}, h("tr", {}, ...COLUMNS.map(([name, title]) => h("th", { scope: "col", title }, name)))),
    h("tbody"));
  $("link").append(h("header", {}, h("h2", { id: "link-title" }, "Link"), age),
    directions.up.node, directions.down.node, history, list, classes, ...budgetParts);
  store.on("state feed theme", update);
  store.on("tick", refreshAge);
  store.on("select", update);
  store.on("edit select", refreshBudget);
  new ResizeObserver(update).observe(history);
}

function refreshAge() {
  if (!store.snapshot) return;
  const old = ageOf(store.snapshot.now_s);
  text(age, store.connected ? "now" : `${span(old)} old`);
  values.backlog(backlog());
  values.lag(lag());
  for (const node of ofVehicle) node.classList.toggle("stale", Boolean(store.vehicle) && isStale(store.vehicle));
  refreshBudget();
}

function update() {
  const link = store.snapshot?.link;
  if (!link) return;
  $("link").classList.toggle("stale", !store.connected);
  const reportedBudgets = store.snapshot.vehicles.map((v) => v.status?.budget_bps ?? 0);
  refreshDirection(directions.up, link.up, link, Math.max(...reportedBudgets, 0) || link.budget_bps);
  refreshDirection(directions.down, link.down, link, link.budget_bps);
  const losses = ({ up, down }) => `${percent(up.loss, 1)} / ${percent(down.loss, 1)}`;
  const own = store.vehicle?.link;
  values.loss(link.up.frames > 0 ? losses(link) : UNKNOWN);
  values.recent(own && !isSilent(store.vehicle) && store.vehicle.last_received_s !== null ? losses(own) : UNKNOWN);
  values.refused(`${store.vehicle?.status?.refused_frames ?? 0} / ${own?.dropped.unauthenticated ?? 0}`);
  const ownBudget = store.vehicle?.status?.budget_bps;
  values.own(ownBudget ? rate(ownBudget) : none);
  values.goodput(`${rate(link.up.goodput_bps)} / ${rate(link.down.goodput_bps)}`);
  values.energy(`${joules(link.up.energy_j)} / ${joules(link.down.energy_j)}`);
  values.mapEnergy(joules(link.energy_per_map_bit_j));
  values.trip(link.round_trip_s === null ? none : `${link.round_trip_s.toFixed(2)} s`);
  refreshClasses(link);
  history.setAttribute("aria-label", `Rate over time. Up now ${rate(link.up.bps_1min)}, down ${rate(link.down.bps_1min)}, budget ${rate(link.budget_bps)}.`);
  drawHistory(history, link, store.snapshot.now_s);
  refreshAge();
}

/** The backlog of the selected vehicle; null before its first report. */
const reported = () => store.vehicle?.link?.backlog ?? null;

function backlog() {
  const r = reported();
  if (r === null) return none;
  const report = `reported ${ago(ageOf(r.at_s))}`;
  if (r.bits === 0) return `empty, ${report}`;
  const end = r.empty_s === null ? "no data received" : `empty in ${span(r.empty_s - store.nowS)}`;
  return `${bits(r.bits)}, ${end}, ${report}`;
}

function lag() {
  const r = reported();
  if (r === null) return none;
  const old = r.map_lag_s === null ? `more than ${span(ageOf(r.at_s))}` : span(r.map_lag_s + ageOf(store.snapshot.now_s));
  return `${old}, ${bits(r.map_bits)}`;
}

/** The bar runs to the budget line at 80 % of its length, so that a breach would show. */
function refreshDirection(d, side, link, budgetBps) {
  // The record of a vehicle alone has no link.
  const place = (bps) => `${budgetBps > 0 ? Math.min(100, (80 * bps) / budgetBps) : 0}%`;
  d.bar.children[0].style.width = place(side.bps_1min);
  d.bar.children[1].style.left = place(side.max_window_bps);
  d.bar.classList.toggle("over", side.max_window_bps > budgetBps);
  text(d.now, rate(side.bps_1min));
  text(d.max, `max. in ${link.budget_window_s} s: ${percent(budgetBps > 0 ? side.max_window_bps / budgetBps : null)} of budget`);
  d.node.title = `${count(side.frames)} frames, ${count(side.lost)} lost`;
}

function refreshClasses(link) {
  const total = Object.values(link.up.bytes_by_class).reduce((a, b) => a + b, 0) || 1;
  const names = classNames(link);
  if (classes.dataset.key !== names.join()) {
    classes.dataset.key = names.join();
    classes.tBodies[0].replaceChildren(...names.map(classLine));
  }
  for (const line of classes.tBodies[0].rows) {
    const up = link.up.bytes_by_class[line.dataset.class] ?? 0;
    const down = link.down.bytes_by_class[line.dataset.class] ?? 0;
    text(line.cells[1], bits(8 * up));
    line.cells[2].firstElementChild.firstElementChild.style.width = `${(100 * up) / total}%`;
    line.cells[2].title = percent(up / total);
    text(line.cells[3], bits(8 * down));
  }
}
