// The first mission in five steps. Each step is done by the state of the mission, not by a click, and the card can be closed for good.

import { hasName, nameOf, shownLabels } from "../book.js";
import { denial } from "../command.js";
import { $, data, h, show, text } from "../dom.js";
import { cellAt } from "../map/readout.js";
import { slotOf } from "../order/status.js";
import { recall, remember } from "../prefs.js";
import { missionKey, store } from "../store.js";
import { weightsOrder } from "./weights.js";

/** Cells from which a map shows more than one kind of sea floor. */
const FIRST_CELLS = 200;

const hasWeight = (v) => shownLabels(v).some((l) => weightsOrder.value(v, l.id) !== 0);
const utility = (v) => slotOf(v, "utility");
const isInForce = (v) => utility(v)?.state === "applied";

/** Metres from where the order was applied, from which a vehicle has come to a place because of it. */
const WAY_M = 3;

/** Whether the vehicle has gone to a label whose weight was sent, since the order was applied: it was over it at a report. */
function hasArrived(v) {
  const since = utility(v).changed_s;
  const at = v.track.findLastIndex(([time]) => time <= since);
  const from = v.track[Math.max(at, 0)];
  const isWeighed = (id) => v.labels.some((l) => l.id === id && l.weight > 0);
  return v.track.slice(at + 1).some(([, x, y]) => {
    const cell = store.map && Math.hypot(x - from[1], y - from[2]) >= WAY_M ? cellAt(store.map, x, y) : null;
    return Boolean(cell?.label) && isWeighed(cell.label);
  });
}

/** What to expect after an order of weights. A vehicle without a plan holds because the weighed labels are done. */
function steerInstruction(v) {
  if (!isInForce(v) || v.status?.mode !== "hold") return "The vehicle plans its path by your weights. Its next report shows the plan as a dashed line.";
  return "The vehicle holds, because no further look at the weighed labels pays. Weigh another label, or weigh unseen floor.";
}

/** A label without an image has the button Request; the others have an image, because spare capacity brings them. */
const requestable = (v) => shownLabels(v).some((l) => l.exemplar.url === null && ["none", "refused"].includes(l.exemplar.state));

/** What to do for an image. A vehicle keeps images of some labels only, so a request can wait long while another is served at once. */
function pictureInstruction(v) {
  const waiting = shownLabels(v).filter((l) => l.exemplar.state === "not_available").map((l) => nameOf(l.id));
  if (waiting.length > 0) return `The vehicle has no new image of ${waiting.join(", ")} yet and sends it later. ${requestAnother(v)}`;
  if (requestable(v)) return "Press Request beside a label. The vehicle sends an image of that sea floor.";
  return "Click the image beside a label, then press Another. The vehicle sends one more image of that sea floor.";
}

const requestAnother = (v) => (requestable(v) ? "Press Request beside another label." : "Click the image beside another label, then press Another.");

/** Name, instruction (which may depend on the vehicle), and whether the step is done. */
const STEPS = [
  ["Look", "Each colour on the map is a label: sea floor that looks alike to the vehicle. The map grows while the vehicle surveys.",
    (v) => v.map.explored_cells >= FIRST_CELLS],
  ["Name", "Click the name of a label and enter a word for it, such as sand.",
    (v) => shownLabels(v).some((l) => hasName(l.id))],
  ["Weigh", "Move the slider of a label that you want to see more of to the right, then press Send weights below the list.",
    (v) => isInForce(v) && hasWeight(v)],
  ["Steer", steerInstruction,
    (v) => isInForce(v) && hasArrived(v)],
  ["Picture", pictureInstruction,
    (v) => v.labels.some((l) => l.exemplar.images.some((image) => image.requested))],
];

/** The steps that were done, for each mission and vehicle: a step that was done once stays done. */
const reached = new Map();

function doneSteps(v) {
  const key = missionKey(v);
  const done = reached.get(key) ?? STEPS.map(() => false);
  reached.set(key, done.map((was, i) => was || STEPS[i][2](v)));
  return reached.get(key);
}

const lines = STEPS.map(([name, instruction]) => {
  const [words, state] = [h("span"), h("span.unseen")];
  const node = h("li", {}, h("b", {}, name), " ", words, state);
  return { node, state, refresh: (v) => text(words, typeof instruction === "string" ? instruction : instruction(v)) };
});
const summary = h("summary");
const close = h("button.quiet", { type: "button", onclick: dismiss }, "Close for good");
const card = h("details.first-mission", { hidden: true, ontoggle: () => remember("first-mission-open", card.open) }, summary, h("ol", {}, ...lines.map((l) => l.node)), close);

export function startFirstMission() {
  if (recall("first-mission-closed", false)) return;
  card.open = recall("first-mission-open", matchMedia("(min-width: 721px)").matches);
  $("label-scroll").before(card);
  store.on("state select edit book", update);
}

function dismiss() {
  remember("first-mission-closed", true);
  card.remove();
  $("labels").focus();
}

function update() {
  const v = store.vehicle;
  show(card, Boolean(v) && denial("order") === null);
  if (!v) return;
  const done = doneSteps(v);
  const next = done.indexOf(false);
  text(summary, next < 0 ? "First mission: all five steps are done" : `First mission, step ${next + 1} of 5: ${STEPS[next][0].toLowerCase()}`);
  lines.forEach(({ node, state, refresh }, i) => {
    refresh(v);
    data(node, "state", done[i] ? "done" : i === next ? "next" : "later");
    text(state, done[i] ? " (done)" : "");
  });
}
