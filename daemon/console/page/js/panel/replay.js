// The bar of a record: play it, jump to its events, and choose whose knowledge is shown.

import { readReplayEvents } from "../api.js";
import { $, announce, h, show, text } from "../dom.js";
import { count } from "../format.js";
import { change, playFault, playHead, seek } from "../play-head.js";
import { store } from "../store.js";
import { kindOf, lineOf, markLegend, momentOf, refreshTimeLine, setEvents, slider, startTimeLine, timeLine, timeText } from "./time-line.js";

const STEP_S = 10;
const SPEEDS = [1, 2, 5, 10, 30, 60, 300];
const FILTERS = { all: "all events", order: "orders", silence: "silences", label: "new labels", loop: "loops closed" };
const SIDES = {
  operator: ["Operator knew", "The map and the reports that had reached the surface by this moment."],
  vehicle: ["Vehicle knew", "The map on board at this moment, whether or not it had been sent."],
  difference: ["Difference", "Only the cells in which the two maps differ: with the vehicle's label, or with the operator's where the vehicle has none."],
};
/** The event that is shown is at most this far before the moment. */
const EVENT_S = 0.002;
/** A record that is playing has passed the event to which it jumped just now. */
const PASSED_S = 1.5;

const button = (words, title, onclick) => h("button", { type: "button", title, onclick }, words);
const before = button("\u2039 Event", "The event before (Shift+\u2190)", () => jump(-1));
const back = button("\u221210\u202fs", "10 seconds back (\u2190)", () => step(-STEP_S));
const play = button("Play", "Play or pause (Space)", toggle);
const on = button("+10\u202fs", "10 seconds forward (\u2192)", () => step(STEP_S));
const next = button("Event \u203a", "The next event (Shift+\u2192)", () => jump(1));
before.setAttribute("aria-label", "Previous event");
next.setAttribute("aria-label", "Next event");
const speed = h("select", { id: "replay-speed", onchange: () => change({ speed: Number(speed.value) }) });
const filter = h("select", { id: "replay-filter", onchange: refresh }, ...Object.entries(FILTERS).map(([value, words]) => h("option", { value }, words)));
const latest = h("p.replay-event", { title: "The last event up to this moment, of those to jump to" });
const errorLine = h("p.error", { role: "alert" });
const sides = Object.entries(SIDES).map(([side, [words, hint]]) => h("button", { type: "button", title: hint, data: { side }, onclick: () => change({ side }) }, words));
const hint = h("p.hint");
const knowledge = h("div.sides", { role: "group", "aria-label": "Whose knowledge is shown" }, ...sides);

const row = (...parts) => h("div.replay-row", {}, ...parts);

/** The events of the record with this key. */
let events = [];
let eventsOf = null;

export function startReplay() {
  $("replay").append(
    row(h("div.replay-keys", { role: "group", "aria-label": "Play" }, before, back, play, on, next), timeLine, timeText),
    row(h("div.replay-choices", {}, h("label.tool-field", { title: "Recorded seconds for each second" }, "Speed", speed),
      h("label.tool-field", { title: "The events to which the buttons jump" }, "Jump to", filter)), latest, markLegend()),
    row(knowledge, hint, errorLine));
  startTimeLine();
  addEventListener("keydown", press);
  store.on("state replay select", refresh);
}

function refresh() {
  show($("replay"), store.replay !== null);
  if (!store.replay) return;
  // Its controls are disabled, so that it has to take the focus to be scrolled by keys.
  $("side").tabIndex = 0;
  readEvents();
  const head = playHead();
  refreshTimeLine();
  text(play, head.is_playing ? "Pause" : "Play");
  refreshSpeed(head.speed);
  const last = wanted().findLast((event) => event.at_utc_s <= head.at_utc_s);
  text(latest, last ? lineOf(last) : "No event yet.");
  for (const [button, direction] of [[before, -1], [next, 1]]) button.setAttribute("aria-disabled", String(target(direction) === undefined));
  text(errorLine, playFault() ?? (head.damage?.length ? `A part of the record could not be read: ${head.damage.join("; ")}` : ""));
  refreshSides(head);
}

function refreshSpeed(now) {
  const offered = [...new Set([...SPEEDS, now])].sort((a, b) => a - b);
  if (speed.dataset.key !== offered.join()) {
    speed.dataset.key = offered.join();
    speed.replaceChildren(...offered.map((value) => h("option", { value }, `${value} \u00d7`)));
  }
  speed.value = String(now);
}

function refreshSides(head) {
  for (const button of sides) {
    show(button, head.sides.length > 1 && head.sides.includes(button.dataset.side));
    button.setAttribute("aria-pressed", String(head.side === button.dataset.side));
    text(button, SIDES[button.dataset.side][0] + (button.dataset.side === "difference" ? differing(head) : ""));
  }
  show(knowledge, head.sides.length > 1);
  text(hint, SIDES[head.side]?.[1] ?? "");
}

/** In how many cells the maps of the selected vehicle differ, where both are known. */
function differing(head) {
  const found = head.differing_cells.find(({ vehicle }) => vehicle === store.selectedId);
  return found ? `: ${found.cells === 1 ? "1 cell" : `${count(found.cells)} cells`}` : "";
}

/** Reads the events once for each record; after a fault, with the next state. */
async function readEvents() {
  const { mission, replay } = store.snapshot;
  const key = `${mission.id} ${replay.from_utc_s} ${replay.to_utc_s}`;
  if (key === eventsOf) return;
  eventsOf = key;
  try {
    events = await readReplayEvents();
  } catch {
    eventsOf = null;
    return;
  }
  setEvents(events);
  refresh();
}

const wanted = () => (filter.value === "all" ? events : events.filter((event) => kindOf(event) === filter.value));

/** The next event from the moment that is shown, or with `direction` -1 the one before. */
function target(direction) {
  const { at_utc_s: at, is_playing: isPlaying, speed: factor } = playHead();
  if (direction > 0) return wanted().find((event) => event.at_utc_s > at);
  const passed = isPlaying ? Math.max(1, factor) * PASSED_S : EVENT_S;
  return wanted().findLast((event) => event.at_utc_s < at - passed);
}

function jump(direction) {
  const event = target(direction);
  if (event) seek(momentOf(event));
  announce(event ? lineOf(event) : direction > 0 ? "There is no later event." : "There is no earlier event.");
}

const step = (seconds) => seek(playHead().at_utc_s + seconds);

function toggle() {
  change({ is_playing: !playHead().is_playing });
}

const ACTS = { " ": toggle, ArrowLeft: () => step(-STEP_S), ArrowRight: () => step(STEP_S), "Shift+ArrowLeft": () => jump(-1), "Shift+ArrowRight": () => jump(1) };
/** Where a key has another use: Space presses buttons, and arrows move the map, tabs and sliders. */
const OTHER_USES = { " ": "input, select, textarea, button, a, summary", Arrow: "input, select, textarea, #chart, #cloud, [role=tab]" };

function press(event) {
  const act = ACTS[event.shiftKey ? `Shift+${event.key}` : event.key];
  if (!act || !store.replay || event.ctrlKey || event.altKey || event.metaKey || $("dialog").open) return;
  const others = OTHER_USES[event.key] ?? OTHER_USES.Arrow;
  if (event.defaultPrevented || (event.target !== slider && event.target.closest?.(others))) return;
  event.preventDefault();
  act();
}
