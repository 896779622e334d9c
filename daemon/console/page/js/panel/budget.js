// The bit budget and the least shares of the classes: dragged while the mission runs, sent when let go.

import { sendBudget } from "../api.js";
import { h, show, text } from "../dom.js";
import { rate } from "../format.js";
import { store } from "../store.js";
import { lifeline, slotOf } from "./lifeline.js";
import { Order } from "./order.js";
import { othersNote } from "./ours.js";
import { spendBox } from "./spend.js";

const CLASSES = ["directive", "status", "fix", "map", "exemplar"];
const LET_GO_MS = 400;
const [LEAST_BPS, MOST_BPS] = [10, 1e5];

function read() {
  const { budget_bps, shares, spend } = store.snapshot.link;
  return { budget_bps, shares: shares ?? null, spend: spend ?? null };
}
const moved = (part, now) => now && JSON.stringify(now) !== JSON.stringify(read()[part]) ? now : null;
const order = new Order("budget", read, (_, { budget_bps: bps, shares, spend }) => sendBudget(bps, moved("shares", shares), moved("spend", spend)));

const number = h("input", { type: "number", id: "budget", min: 1, step: 1, required: true, oninput: () => (typed = true) });
const slider = h("input", { type: "range", min: 0, max: 1, step: 0.01, "aria-label": "Budget, logarithmic", oninput: slide, onchange: soon });
const bar = h("div.stack", { "aria-hidden": "true" });
const free = h("span.free");
const rows = Object.fromEntries(CLASSES.map((c, i) => [c, shareRow(c, i)]));
const rest = h("output.value");
const shareBox = h("div.shares", { role: "group", "aria-label": "Least shares of the classes" },
  h("h3", {}, "Least shares of what is sent, %"), bar, ...CLASSES.map((c) => rows[c].row),
  h("div.share-row", {}, h("span.swatch"), h("span", {}, "free"), h("span"), rest));
const extras = spendBox(() => value().spend, (spend) => {
  clearTimeout(timer);
  order.set(store.vehicle, { ...value(), spend });
  soon();
});
const error = h("p.error", { role: "alert" });
const others = othersNote(order.ours, "Budget");
const line = lifeline("Budget");
let typed = false;
let timer = 0;

bar.append(...CLASSES.flatMap((c) => [rows[c].segment, rows[c].handle]), free);
const form = h("form.budget", { onsubmit: submit, onkeydown: (event) => event.key === "Escape" && forget() },
  h("label", { for: "budget" }, "Budget, bit/s"), number, h("button", { type: "submit" }, "Set"));
export const budgetParts = [form, slider, shareBox, extras.node, error, others.node, line.node];

function shareRow(name, i) {
  const range = h("input", { type: "range", min: 0, max: 100, step: 1, "aria-label": `Least share of ${name}, percent`, oninput: () => setShare(name, range.valueAsNumber), onchange: soon });
  const value = h("output.value");
  const row = h("div.share-row", { data: { share: name } }, h("span.swatch", { data: { tone: String(i) } }), h("span", {}, name), range, value);
  const handle = h("span.handle", { title: `Drag: least share of ${name}`, onpointerdown: (event) => drag(event, name, handle) });
  return { row, range, value, segment: h("span.segment", { data: { tone: String(i) } }), handle };
}

const value = () => order.value(store.vehicle);

/** What one class may take at most: the shares add up to 100 or less. */
function setShare(name, percent) {
  const { shares, ...else_ } = value();
  const taken = CLASSES.reduce((sum, c) => sum + (c === name ? 0 : shares[c]), 0);
  const share = Math.round(Math.min(100 - taken, Math.max(0, percent)));
  clearTimeout(timer);
  order.set(store.vehicle, { ...else_, shares: { ...shares, [name]: share } });
}

function drag(event, name, handle) {
  event.preventDefault();
  handle.setPointerCapture(event.pointerId);
  const box = bar.getBoundingClientRect();
  const before = CLASSES.slice(0, CLASSES.indexOf(name)).reduce((sum, c) => sum + value().shares[c], 0);
  const move = (e) => setShare(name, (100 * (e.clientX - box.left)) / box.width - before);
  const end = () => {
    handle.removeEventListener("pointermove", move);
    soon();
  };
  handle.addEventListener("pointermove", move);
  handle.addEventListener("lostpointercapture", end, { once: true });
}

/** The slider is logarithmic, two digits. */
const bpsAt = (t) => Number((LEAST_BPS * (MOST_BPS / LEAST_BPS) ** t).toPrecision(2));
const placeOf = (bps) => Math.log(bps / LEAST_BPS) / Math.log(MOST_BPS / LEAST_BPS);

function slide() {
  clearTimeout(timer);
  typed = false;
  order.set(store.vehicle, { ...value(), budget_bps: bpsAt(slider.valueAsNumber) });
}

/** Sends once hands are off: keys let go of a slider at each step. */
function soon() {
  clearTimeout(timer);
  timer = setTimeout(send, LET_GO_MS);
}

async function send() {
  const vehicle = store.vehicle;
  if (!order.changed(vehicle)) return;
  if (!(await order.send(vehicle))) order.revert(vehicle);
}

async function submit(event) {
  event.preventDefault();
  const bps = Math.round(Number(number.value));
  typed = false;
  order.set(store.vehicle, { ...value(), budget_bps: bps });
  if (!(await order.send(store.vehicle))) {
    order.revert(store.vehicle);
    number.value = bps;
    typed = true;
  }
}

function forget() {
  typed = false;
  refreshBudget();
}

export function refreshBudget() {
  const vehicle = store.vehicle;
  if (!vehicle) return;
  const { error: problem, waiting } = order.settle(vehicle);
  const { budget_bps: bps, shares, spend } = value();
  if (!typed) number.value = bps;
  if (document.activeElement !== slider || !order.changed(vehicle)) slider.value = placeOf(bps);
  slider.setAttribute("aria-valuetext", rate(bps));
  show(shareBox, shares !== null);
  if (shares) refreshShares(shares);
  extras.refresh(spend);
  text(error, problem ?? "");
  others.update(vehicle);
  const slot = slotOf(vehicle, "budget");
  show(line.node, slot !== null || waiting !== null);
  line.update(slot, waiting);
}

function refreshShares(shares) {
  let sum = 0;
  for (const c of CLASSES) {
    const { range, value: shown, segment, handle } = rows[c];
    sum += shares[c];
    if (range.valueAsNumber !== shares[c]) range.value = shares[c];
    range.setAttribute("aria-valuetext", `${shares[c]} percent`);
    text(shown, String(shares[c]));
    segment.style.width = `${shares[c]}%`;
    handle.style.left = `${sum}%`;
  }
  text(rest, String(100 - sum));
}
