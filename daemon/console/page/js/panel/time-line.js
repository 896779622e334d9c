// The time line of a record: a slider over all of it, the marks of its events, and the moment that is shown.

import { h, text } from "../dom.js";
import { elapsed, utc } from "../format.js";
import { playHead, seek } from "../play-head.js";
import { store } from "../store.js";

/** The kinds of events with a mark of their own. Events of one pixel column share the mark of the first kind here. */
export const KINDS = { fault: "fault", silence: "silence", order: "order", label: "new label", loop: "loop closed", other: "other event" };
const RANKS = Object.keys(KINDS);
export const kindOf = (event) => (Object.hasOwn(KINDS, event.kind) ? event.kind : "other");

/** The middle of the slider's thumb stays this far from its ends. */
const END_PX = 8;
const MAX_LINES = 8;

export const slider = h("input", {
  type: "range", id: "replay-at", min: 0, step: "any", "aria-label": "Moment of the record",
  oninput: () => seekTo(slider.valueAsNumber), onpointerdown: hold,
});
const marks = h("div.marks", { "aria-hidden": "true", onclick: (event) => event.target.dataset.at && seek(Number(event.target.dataset.at)) });
const moment = h("b.moment", { title: "The moment that is shown" });
const place = h("span", { title: "Time since the beginning of the record, and its length" });
export const timeLine = h("div.time-line", {}, marks, slider);
export const timeText = h("p.replay-time", {}, moment, " ", place);
let events = [];
/** Whether a pointer holds the thumb: the record may be playing on under it. */
let isHeld = false;
let movedTo = null;

export function startTimeLine() {
  new ResizeObserver(drawMarks).observe(marks);
}

/** Just after an event, so that what it changed is shown. */
export const momentOf = (event) => event.at_utc_s + 0.001;

export function setEvents(list) {
  events = list;
  drawMarks();
}

function seekTo(seconds) {
  movedTo = seconds;
  seek(store.replay.from_utc_s + seconds);
}

function hold() {
  [isHeld, movedTo] = [true, null];
  for (const end of ["pointerup", "pointercancel"]) addEventListener(end, release, { once: true });
}

/** The record stands where the thumb was left, wherever it has played on to meanwhile. */
function release() {
  isHeld = false;
  if (movedTo !== null && playHead().is_playing) seekTo(movedTo);
  movedTo = null;
}

export function refreshTimeLine() {
  const { from_utc_s: from, to_utc_s: to, at_utc_s: at } = playHead();
  slider.max = to - from;
  if (!isHeld) slider.value = at - from;
  const shown = isHeld && movedTo !== null ? from + movedTo : at;
  text(moment, utc(shown));
  text(place, `${elapsed(shown - from)} of ${elapsed(to - from)}`);
  slider.setAttribute("aria-valuetext", `${utc(shown)}, ${place.textContent}`);
}

const vehicleName = (event) => store.snapshot.vehicles.find((v) => v.id === event.vehicle)?.name;

/** An event as one line, for people. */
export const lineOf = (event) => `${utc(event.at_utc_s)}: ${[vehicleName(event), event.text].filter(Boolean).join(": ")}`;

/** One mark for all events of a pixel column, since a record may have thousands. */
function drawMarks() {
  if (!store.replay) return;
  const { from_utc_s: from, to_utc_s: to } = store.replay;
  const width = marks.clientWidth - 2 * END_PX;
  const columns = new Map();
  for (const event of events) {
    const x = END_PX + Math.round((width * (event.at_utc_s - from)) / Math.max(1e-3, to - from));
    if (!columns.has(x)) columns.set(x, []);
    columns.get(x).push(event);
  }
  marks.replaceChildren(...[...columns].map(([x, own]) => markOf(x, own)));
}

function markOf(x, own) {
  const first = own.reduce((a, b) => (RANKS.indexOf(kindOf(b)) < RANKS.indexOf(kindOf(a)) ? b : a));
  const lines = own.slice(0, MAX_LINES).map(lineOf);
  if (own.length > MAX_LINES) lines.push(`and ${own.length - MAX_LINES} more`);
  const mark = h("i.mark", { data: { kind: kindOf(first), at: momentOf(first), events: own.length }, title: lines.join("\n") });
  mark.style.left = `${x}px`;
  return mark;
}

/** What each mark means. */
export const markLegend = () =>
  h("ul.mark-kinds", { "aria-label": "Marks of events" }, ...Object.entries(KINDS).map(([kind, name]) =>
    h("li", {}, h("i.mark", { data: { kind }, "aria-hidden": "true" }), name)));
