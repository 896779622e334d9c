// Alarms and requests: no connection, a request for command, a silent vehicle, a map that is not up to date, the end of the mission.

import { soundAlarm } from "../alarm.js";
import { dismissEarlierMap, giveAgain, restoreOrders, sendCommand, takeOver } from "../api.js";
import { denial, hasCommand } from "../command.js";
import { $, announce, h, keyed, show, text } from "../dom.js";
import { ago, freeSpace, missionTime, span, utc } from "../format.js";
import { ageOf, isHeard, isSilent, store } from "../store.js";
import { retryNow } from "../feed.js";

/** Keys of the banners of a record that concern the present. */
const OF_THE_PAGE = ["lost", "record"];

/** How long orders may be unknown before people are told. */
const UNKNOWN_MS = 10_000;

let announced = "";
/** Keys of the alarms that have sounded and are not over. */
let sounded = new Set();

export function startBanners() {
  store.on("state feed tick", update);
}

function update() {
  const banners = current();
  // The alarms of a record come and go with its moment.
  const heads = banners.filter((b) => !store.replay || OF_THE_PAGE.includes(b.key)).map((b) => b.head).join(". ");
  if (heads !== announced) announce(heads || "All alarms have cleared.");
  announced = heads;
  const alarms = banners.filter((b) => b.kind !== "info").map((b) => b.key);
  if (!store.replay && alarms.some((key) => !sounded.has(key))) soundAlarm();
  sounded = new Set(alarms);
  keyed($("banners"), banners, (b) => b.key, make, refresh);
  show($("banners"), $("banners").childElementCount > 0);
}

function current() {
  const found = [];
  if (store.feed.state === "lost") found.push(lost());
  if (store.replay) found.push(recorded());
  for (const v of store.snapshot?.vehicles ?? []) {
    if (v.other_surface) found.push(rival(v));
    found.push(...withdrawn(v));
    if (isSilent(v)) found.push(silent(v));
    if (store.connected && store.mapFaults.has(v.id)) found.push(outdated(v));
    if (v.link.mismatch) found.push(mismatched(v));
    if (isLongUnknown(v)) found.push(unknownInForce(v));
    if (v.map.earlier) found.push(earlier(v));
    if (isHolding(v) || isStopped(v)) found.push(stopped(v));
    if (v.status?.faults?.some((fault) => fault.is_grave)) found.push(faulty(v));
    if (v.status?.disk?.journal_refused || v.status?.disk?.checkpoint_refused) found.push(refusingVehicle(v));
  }
  if (store.snapshot?.storage?.failing) found.push(refusing(store.snapshot.storage));
  if (hasCommand()) found.push(...store.snapshot.command.requests.map(requested));
  if (store.snapshot?.mission.ended) found.push(ended());
  return found;
}

function lost() {
  const since = span((performance.now() - store.feed.sinceMs) / 1000);
  const wait = Math.max(0, (store.feed.retryMs - performance.now()) / 1000);
  const next = wait > 0 ? `trying again in ${span(Math.ceil(wait))}` : "trying now";
  return {
    key: "lost", kind: "bad", head: "No connection to scenecast",
    body: `for ${since}; ${next}. All displayed values may be out of date.`, action: ["Try now", retryNow],
  };
}

function recorded() {
  return { key: "record", kind: "info", head: `Record of ${utc(store.replay.from_utc_s, 16)}: nothing here is live.`, body: "It takes no orders, and ages count to the moment that is shown." };
}

function silent(v) {
  const every = `a frame is expected every ${span(v.expected_interval_s)}`;
  const last = v.last_received_s === null
    ? `no frame received since the start; ${every}. If the vehicle is in range, its log says which setting differs: a key or the number of the mission.`
    : `last frame received ${span(ageOf(v.last_received_s))} ago at ${missionTime(v.last_received_s)}; ${every}.`;
  return { key: `silent-${v.id}`, kind: "warn", head: `${v.name} is silent`, body: `${last} ${contact(v)}` };
}

function outdated(v) {
  return { key: `map-${v.id}`, kind: "warn", head: `The map of ${v.name} is not up to date`, body: `${store.mapFaults.get(v.id)}.` };
}

/** Another surface with the same key holds the vehicle, or calls it. */
function rival(v) {
  const { name, holds, heard_s: heard, is_silent: isGone, is_taken_over: takesOver } = v.other_surface;
  const other = name ? `The surface ${name}` : "Another surface";
  const last = `The vehicle last heard it ${span(ageOf(heard))} ago`;
  if (!holds) {
    const body = `${last}. This surface holds the vehicle, which refuses the other one.`;
    return { key: `calls-${v.id}`, kind: "info", head: `${other} calls ${v.name}`, body };
  }
  const mayTake = isGone || denial("settings") === null;
  const how = mayTake ? "" : " An administrator may take the vehicle over, or an operator after 120 s without a sign of that surface.";
  const then = takesOver ? "This surface takes it over." : `A hold and an abort are obeyed at once.${how}`;
  return {
    key: `held-${v.id}-${mayTake && !takesOver}`, kind: "bad", head: `${other} holds ${v.name}`,
    body: `${last}, and obeys it and not this one. ${then}`,
    action: mayTake && !takesOver ? ["Take over", () => act(takeOver(v.id))] : undefined,
  };
}

/** Orders that are sent no more unless an operator wishes it. */
function withdrawn(v) {
  const asking = v.directive.slots.filter((slot) => slot.asks);
  const lost = asking.filter((slot) => slot.reason?.startsWith(LOST));
  const single = asking.filter((slot) => !lost.includes(slot)).map((slot) => ({
    key: `withdrawn-${v.id}-${slot.slot}-${slot.version}`, kind: "warn", head: `${v.name}: ${slot.name} is withdrawn`,
    body: `Version ${slot.version}, given ${span(ageOf(slot.issued_s))} ago: ${slot.reason}`,
    action: [`Send ${slot.name} again`, () => act(giveAgain(v.id, slot.slot))],
  }));
  return lost.length > 0 ? [lostOrders(v, lost), ...single] : single;
}

/** How the reason of an order begins that the vehicle has lost. */
const LOST = "the vehicle has no record";

/** A member of an order with its unit, such as "time 600 s". */
const member = ([name, value]) => {
  const [, what, unit] = /^(.*?)(?:_(m|s))?$/.exec(name);
  return `${what.replaceAll("_", " ")} ${[value].flat().join(" to ")}${unit ? ` ${unit}` : ""}`;
};

/** The parts of an order by its slot, in short. */
const PARTS = {
  fence: ({ fence, keep_outs: outs, return_point: back }) => [fence && `${fence.length} corners`, outs.length > 0 && `${outs.length} area${outs.length === 1 ? "" : "s"} to stay out of`, back && "return point"],
  limits: (limits) => Object.entries(limits).filter(([, value]) => value !== null).map(member),
  areas: ({ areas }) => areas.map((area) => `weight ${area.weight}`),
  destination: ({ place }) => [place && `E ${place[0].toFixed(1)} N ${place[1].toFixed(1)} m`],
  utility: ({ weights }) => Object.entries(weights).map(([label, weight]) => `label ${label}: ${weight}`),
};

/** The name of an order and what it says, as this surface gave it. */
function contentOf(v, slot) {
  const order = v[slot.slot];
  const parts = (order && PARTS[slot.slot]?.(order).filter(Boolean)) || [];
  return parts.length > 0 ? `${slot.name} (${parts.join(", ")})` : slot.name;
}

function lostOrders(v, lost) {
  const restored = lost.filter((slot) => slot.name !== "resume");
  const names = lost.map((slot) => contentOf(v, slot)).join("; ");
  return {
    key: `lost-${v.id}-${restored.length}`, kind: "bad", head: `${v.name} has lost its orders`,
    body: `It has no record any more of: ${names}. An order to resume is not sent again.`,
    action: restored.length > 0 ? ["Send them again", () => act(restoreOrders(v.id))] : undefined,
  };
}

/** An order from a banner, whose error is said. */
const act = (sent) => sent.catch((error) => announce(error.message));

export const isHolding = (v) => v.status?.mode === "hold";
/** Whether the survey has ended before its time. */
export const isStopped = (v) => ["return", "surface", "abort"].includes(v.status?.mode);

/** A hold, an abort or a return is in force, whoever has ordered it. */
function stopped(v) {
  return { key: `stopped-${v.id}`, kind: "info", head: `${v.name} does not survey`, body: `${v.status.activity}, as reported ${ago(ageOf(v.status.at_s))}.` };
}

/** Equipment fails with which the survey does not proceed as planned. */
function faulty(v) {
  const grave = v.status.faults.filter((fault) => fault.is_grave).map((fault) => fault.text);
  return { key: `fault-${v.id}`, kind: "warn", head: `${v.name}: ${grave.join(", ")}`, body: `As reported ${ago(ageOf(v.status.at_s))}.` };
}

/** A setting differs at both ends, or somebody else transmits under the vehicle's address. */
function mismatched(v) {
  return { key: `mismatch-${v.id}`, kind: "bad", head: `The settings of ${v.name} do not fit`, body: `${v.link.mismatch}.` };
}

const unknownOrders = (v) => Object.keys(v.in_force).filter((slot) => v.in_force[slot] === "unknown");

/** Since when a vehicle has followed orders that are unknown here. */
const unknownSince = new Map();

/** Orders that have just been given, or asked for, are known within some seconds. */
function isLongUnknown(v) {
  if (unknownOrders(v).length === 0) {
    unknownSince.delete(v.id);
    return false;
  }
  if (!unknownSince.has(v.id)) unknownSince.set(v.id, performance.now());
  return performance.now() - unknownSince.get(v.id) >= UNKNOWN_MS;
}

function unknownInForce(v) {
  return {
    key: `in-force-${v.id}`, kind: "info", head: `${v.name} follows orders that are unknown here`,
    body: `In force, unknown here: ${unknownOrders(v).join(", ")}. Another surface has sent them, or this one lost its files; the surface asks the vehicle for them.`,
  };
}

/** The map in view is that of an earlier run of the vehicle or of the surface. */
function earlier(v) {
  const { run, current_run, current_epoch, current_cells } = v.map.earlier;
  const again = run === current_run && v.map.epoch === current_epoch;
  const which = again ? "received before the link was begun again" : `of run ${run}, label epoch ${v.map.epoch}`;
  const last = v.map.updated_s === null ? "" : `, last changed ${span(ageOf(v.map.updated_s))} ago`;
  const now = again ? "" : ` in run ${current_run}, label epoch ${current_epoch}`;
  return {
    key: `earlier-${v.id}`, kind: "info", head: `The map of ${v.name} in view is an earlier one`,
    body: `${which}${last}. ${current_cells} of its ${v.map.explored_cells} cells have been received${now}; the current map replaces it when it has as many.`,
    action: ["Show the current map", () => dismissEarlierMap(v.id).catch((error) => announce(error.message))],
  };
}

function refusing(storage) {
  const free = storage.free_bytes === null ? "" : ` Free: ${Math.floor(storage.free_bytes / 1e6)} MB.`;
  return {
    key: "storage", kind: "bad", head: "The surface cannot write its files",
    body: `${storage.failing} (${storage.folder}).${free} Map and orders are in memory only and would be lost in a restart; the surface tries again.`,
  };
}

/** The vehicle's last report: its disk may take the files again by now. */
function refusingVehicle(v) {
  const { journal_refused: journal, checkpoint_refused: checkpoint, free_bytes: free } = v.status.disk;
  const files = [journal && "journal", checkpoint && "checkpoint"].filter(Boolean).join(" and ");
  const body = [
    `Reported ${span(ageOf(v.status.at_s))} ago; ${freeSpace(free)}.`,
    journal && "It obeys hold and abort from memory and refuses other orders.",
    checkpoint && "A restart would lose the scene model since its last checkpoint.",
    "The vehicle tries again.",
  ];
  return {
    key: `disk-${v.id}`, kind: journal ? "bad" : "warn", head: `${v.name} cannot write its ${files}`,
    body: body.filter(Boolean).join(" "),
  };
}

export function contact(v) {
  if (v.next_contact_s === null) return "The next contact is unknown.";
  const wait = v.next_contact_s - store.nowS;
  const when = missionTime(v.next_contact_s);
  if (wait < 0 && isHeard(v)) return "The vehicle is in contact.";
  return wait >= 0 ? `Next contact in ${span(wait)}, at ${when}.` : `Contact was due ${span(-wait)} ago, at ${when}.`;
}

function ended() {
  return { key: "ended", kind: "info", head: "The mission has ended", body: `at ${missionTime(store.snapshot.mission.ended_s)}. The map is final, and the vehicle takes no more orders.` };
}

function requested({ name, at_s: at }) {
  const body = `${span(ageOf(at))} ago. You have command.`;
  const handOver = () => sendCommand("hand_over", name).catch(() => {});
  return { key: `command-${name}`, kind: "info", head: `${name} requests command`, body, action: ["Hand over", handOver] };
}

function make(banner) {
  const [name, onclick] = (!store.replay || OF_THE_PAGE.includes(banner.key) ? banner.action : null) ?? [];
  const button = name ? h("button", { type: "button", onclick }, name) : null;
  return h("p.banner", { data: { kind: banner.kind } }, h("b"), " ", h("span"), " ", button);
}

function refresh(node, banner) {
  text(node.children[0], banner.head);
  text(node.children[1], banner.body);
}
