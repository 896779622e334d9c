// The selected vehicle: its position and activity as it reports them, and the slots of its directive.

import { $, h, keyed, row, show, text } from "../dom.js";
import { ago, count, degrees, freeSpace, metres, missionTime, none, span } from "../format.js";
import { nameOf } from "../book.js";
import { inWorld } from "../map/frames.js";
import { bearing } from "../map/measure.js";
import { lengthOf, pathOf } from "../map/path.js";
import { describe, nameOfStatus } from "../order/status.js";
import { ageOf, isHeard, isStale, store } from "../store.js";
import { refreshStop, stopParts } from "./stop.js";
import { refreshWhy, whyPart } from "./try.js";

const NAMES = { utility: "Weights", hold: "Hold", resume: "Resume", abort: "Abort", limits: "Limits", fence: "Fence", areas: "Areas", destination: "Destination", settings: "Settings", budget: "Budget", requests: "Images", fix: "Position fix" };
const title = h("h2", { id: "vehicle-title" });
const mode = h("span.mode");
const age = h("p.age", { title: "The age of the last report, the time since the last frame, and the longest usual pause between two frames" });
/** Free space in bytes below which the panel warns. */
const LOW_SPACE = 1e9;
const WHOLE_LINES = ["faults", "registration", "path", "cells", "disk"];
const values = {};
const lines = {};
const list = h("dl.values");
const slots = h("ul.slots");
const noOrders = h("p.note", {}, "No order sent yet.");

export function startVehicle() {
  for (const [key, name, hint] of [
    ["faults", "Faults", "Equipment of the vehicle that fails, by its last report: autopilot, camera, navigation, labels of other programs"],
    ["position", "East, north", "The position that the vehicle reported last, metres east and north of the origin"],
    ["depth", "Depth", "The depth of the vehicle below the surface of the water"],
    ["heading", "Heading", "The direction of the vehicle's bow, clockwise from north"],
    ["sigma", "Position \u03c3", "Standard deviation of the position; the ring on the map has twice this radius"],
    ["fix", "Last fix", "The age of the last position fix that the vehicle has used"],
    ["registration", "Camera frames", "What placed the last camera frame on the map, and how exactly against earlier parts of it; rings on the track mark places where a frame overlapped with an earlier track"],
    ["waypoint", "Waypoint", "Distance and direction from the reported position to the next place of the plan"],
    ["path", "Path", "The plan from the reported position through the waypoint to the last reported place; dashed on the map"],
    ["arrival", "Target", "What the plan leads to first, and when the vehicle gets there at its speed"],
    ["favoured", "Over favoured", "The part of its time that the vehicle is over floor of favoured labels, by its track and the map as it is now: since the surface learned that the weights are applied, and before"],
    ["cells", "Vehicle's map", "Explored cells and labels of the vehicle's own map, by its last report"],
    ["contact", "Next contact", "When the next frame of the vehicle is due"],
    ["disk", "Vehicle's disk", "The files that the vehicle cannot write, and its free space, by its last report"],
    ["gps", "Surface GPS", "The position of the surface by GPS, and the number of fixes sent to vehicles"],
  ]) {
    const [node, set] = row(name, hint);
    values[key] = set;
    lines[key] = node;
    node.classList.toggle("whole", WHOLE_LINES.includes(key));
    list.append(node);
  }
  $("vehicle").append(h("header", {}, title, mode), age, list, whyPart,
    h("h3", {}, "Directive"), slots, noOrders, ...stopParts);
  store.on("state select tick feed edit", update);
}

function update() {
  const v = store.vehicle;
  if (!v) return;
  const s = v.status;
  text(title, v.name);
  const activity = s?.activity ?? "unknown";
  text(mode, s?.autopilot_silent ? `${activity}, autopilot silent` : activity);
  mode.dataset.mode = s?.mode ?? "none";
  $("vehicle").classList.toggle("stale", isStale(v));
  text(age, s ? `Status ${span(ageOf(s.at_s))} old \u00b7 received ${ago(ageOf(v.last_received_s))}, due every ${span(v.expected_interval_s)}` : "No status received yet.");
  values.faults(s?.faults.map((fault) => fault.text).join(", ") ?? "");
  show(lines.faults, Boolean(s?.faults.length));
  lines.faults.classList.add("warn");
  values.position(s ? inWorld(v, s.x_m, s.y_m).map((m) => metres(m)).join(", ") : none);
  values.depth(s ? metres(-s.z_m) : none);
  values.heading(s ? degrees(s.heading_deg) : none);
  values.sigma(s ? metres(s.sigma_m) : none);
  values.fix(s?.fix_age_s === null || !s ? "none" : `${span(s.fix_age_s + ageOf(s.at_s))} ago`);
  values.registration(registration(v.registration));
  lines.registration.classList.toggle("warn", v.registration?.tie === "odometry");
  values.waypoint(s?.waypoint ? leg(s) : none);
  values.path(s?.waypoint ? plannedPath(s) : none);
  const arrival = isStale(v) ? null : arrivalText(v);
  values.arrival(arrival ?? "");
  show(lines.arrival, arrival !== null);
  values.favoured(v.favoured_time ? favouredText(v.favoured_time) : "");
  show(lines.favoured, Boolean(v.favoured_time));
  refreshWhy(v);
  values.cells(s ? `${count(s.cells)} cells, ${s.labels} labels` : none);
  values.contact(v.next_contact_s === null ? "unknown" : `${missionTime(v.next_contact_s)}, ${due(v)}`);
  values.disk(disk(s?.disk));
  show(lines.disk, Boolean(s?.disk));
  lines.disk.classList.toggle("warn", isDiskWanting(s?.disk));
  values.gps(gps(store.snapshot.position));
  keyed(slots, v.directive.slots, (x) => x.slot, makeSlot, refreshSlot);
  show(noOrders, v.directive.slots.length === 0);
  refreshStop(v);
}

const total = (counts) => Object.values(counts).reduce((sum, n) => sum + n, 0);

const TIES = { odometry: "lost, by odometry", frame_before: "by the frame before", earlier_track: "by an earlier track", off: "by odometry, registration is off" };

/** What placed the last camera frames on the map. */
function registration(r) {
  // Before the first frame there is nothing to place.
  if (!r || (r.tie === "odometry" && r.sigma_m === 0)) return none;
  if (r.tie === "off") return TIES.off;
  const share = r.share < 0.995 ? `, ${Math.round(100 * r.share)} % of the last 32 by images` : "";
  return `${TIES[r.tie]}, \u00b1 ${metres(r.sigma_m, 2)}${share}, ${count(r.closed)} closed loops`;
}

function gps(p) {
  if (!p) return "none";
  const rejected = total(p.usbl_rejected);
  const state = p.is_valid ? `\u00b1 ${metres(p.sigma_m)}` : "no position";
  return `${state}, ${count(p.fixes_sent)} fix${p.fixes_sent === 1 ? "" : "es"} sent${rejected ? `, ${count(rejected)} USBL rejected` : ""}`;
}

function disk(d) {
  if (!d) return "not reported";
  const files = [d.journal_refused && "journal", d.checkpoint_refused && "checkpoint"].filter(Boolean);
  return `${files.length > 0 ? `refuses ${files.join(" and ")}, ` : ""}${freeSpace(d.free_bytes)}`;
}

const isDiskWanting = (d) => Boolean(d && (d.journal_refused || d.checkpoint_refused || (d.free_bytes ?? LOW_SPACE) < LOW_SPACE));

/** A contact that was due counts as overdue once the vehicle has been silent for longer than a frame is expected to take. */
const due = (v) => {
  if (v.next_contact_s >= store.nowS) return `in ${span(v.next_contact_s - store.nowS)}`;
  return isHeard(v) ? "now" : "overdue";
};

function leg(s) {
  const to = s.waypoint;
  return `${metres(Math.hypot(to[0] - s.x_m, to[1] - s.y_m))} at ${degrees(bearing([s.x_m, s.y_m], to))}`;
}

function plannedPath(s) {
  const places = pathOf(s);
  const n = places.length - 1;
  return `${n} waypoint${n === 1 ? "" : "s"}, ${metres(lengthOf(places))}${s.path_continues ? ", continues" : ""}`;
}

/** When the vehicle gets to what its plan leads to; null once it should be there by its plan. */
function arrivalText({ aims, status }) {
  const first = aims?.first;
  if (!first || status?.mode !== "survey") return null;
  const leftS = first.arrival_s - store.nowS;
  const what = first.label === null ? first.reason : `${first.reason === "expected" ? "expected " : ""}${nameOf(first.label)}`;
  if (leftS > 0) return `at ${what} in about ${span(leftS)}`;
  return first.along_m === 0 ? `at ${what} now` : null;
}

const favouredText = ({ share, before }) =>
  `${Math.round(100 * share)} % of the time${before === null ? "" : `, before the order ${Math.round(100 * before)} %`}`;

const makeSlot = () => h("li.slot", {}, h("span.name"), h("span.version"), h("span.state"), h("span.since"));

function refreshSlot(node, slot) {
  const [name, version, state, since] = node.children;
  text(name, NAMES[slot.name] ?? slot.name);
  text(version, `v${slot.version}`);
  text(state, nameOfStatus(slot.state));
  text(since, span(ageOf(slot.changed_s)));
  node.dataset.state = slot.state;
  node.title = describe(slot);
}
