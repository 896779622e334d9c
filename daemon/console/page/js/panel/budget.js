// The bit budget, the minimum shares of the classes and the use of spare capacity. A change is sent when the control is released.

import { sendBudget } from "../api.js";
import { denial } from "../command.js";
import { h, show, text } from "../dom.js";
import { rate } from "../format.js";
import { Order } from "../order/order.js";
import { replacedNote } from "../order/sent-versions.js";
import { orderStatus, slotOf } from "../order/status.js";
import { store } from "../store.js";
import { backgroundBox } from "./background.js";
import { bought, broughtText } from "./bought.js";
import { classHelp } from "./class-help.js";

const CLASSES = ["directive", "status", "fix", "map", "exemplar"];
const RELEASE_MS = 400;
const [MIN_BPS, MAX_BPS] = [10, 1e5];

function read() {
  const { budget_bps, shares, background } = store.snapshot.link;
  return { budget_bps, shares, background };
}
/** A member of the edit if it differs from the server's. */
const moved = (member, now) => (JSON.stringify(now) !== JSON.stringify(read()[member]) ? now : null);
const order = new Order("budget", read, (_, value) => {
  const { budget_bps: bps, shares, background } = value();
  return sendBudget(bps, moved("shares", shares), moved("background", background));
});

const number = h("input", { type: "number", id: "budget", min: 1, step: 1, required: true, oninput: () => (typed = true) });
const slider = h("input", { type: "range", min: 0, max: 1, step: 0.01, "aria-label": "Budget, logarithmic", oninput: slide, onchange: sendSoon });
const bar = h("div.stack", { "aria-hidden": "true" });
const free = h("span.free");
const rows = Object.fromEntries(CLASSES.map((c, i) => [c, shareRow(c, i)]));
const rest = h("output.value");
const brings = Object.fromEntries(["map", "exemplar", "free"].map((c) => [c, h("p.brings", { title: "By what waits at the vehicle, and the losses and heads of the link so far" })]));
const shareBox = h("div.shares", { role: "group", "aria-label": "Minimum shares of the classes" },
  h("h3", {}, "Minimum shares, %"), bar, ...CLASSES.flatMap((c) => [rows[c].row, ...(brings[c] ? [brings[c]] : [])]),
  h("div.share-row", { title: "The rest, for whatever is waiting" }, h("span.swatch"), h("span", {}, "free"), h("span"), rest), brings.free);
const streams = backgroundBox(() => value().background, (background) => {
  clearTimeout(timer);
  order.set(store.vehicle, { ...value(), background });
  sendSoon();
});
const deniedLine = h("p.note.denied");
const errorLine = h("p.error", { role: "alert" });
const replaced = replacedNote(order.sentVersions, "Budget");
const status = orderStatus("Budget");
let typed = false;
let timer = 0;

bar.append(...CLASSES.flatMap((c) => [rows[c].segment, rows[c].handle]), free);
const form = h("form.budget", { onsubmit: submit, onkeydown: (event) => event.key === "Escape" && forget() },
  h("label", { for: "budget", title: "Bits a second that the vehicle may transmit on the mean; the modem is silent for the rest of the time" }, "Budget, bit/s"), number, h("button", { type: "submit" }, "Set"));
export const budgetParts = [form, slider, shareBox, streams.node, deniedLine, errorLine, replaced.node, status.node];

function shareRow(name, i) {
  const range = h("input", { type: "range", min: 0, max: 100, step: 1, "aria-label": `Minimum share of ${name}, percent`, oninput: () => setShare(name, range.valueAsNumber), onchange: sendSoon });
  const value = h("output.value");
  const row = h("div.share-row", { data: { share: name }, title: `${classHelp(name)}: at least this share of the budget while there are any to send` }, h("span.swatch", { data: { tone: String(i) } }), h("span", {}, name), range, value);
  const handle = h("span.handle", { title: `Drag: minimum share of ${name}`, onpointerdown: (event) => drag(event, name, handle) });
  return { row, range, value, segment: h("span.segment", { data: { tone: String(i) } }), handle };
}

const value = () => order.value(store.vehicle);

/** Sets the share of one class, at most so that the shares add up to 100. */
function setShare(name, percent) {
  const { shares, ...others } = value();
  const taken = CLASSES.reduce((sum, c) => sum + (c === name ? 0 : shares[c]), 0);
  const share = Math.round(Math.min(100 - taken, Math.max(0, percent)));
  clearTimeout(timer);
  order.set(store.vehicle, { ...others, shares: { ...shares, [name]: share } });
}

function drag(event, name, handle) {
  event.preventDefault();
  handle.setPointerCapture(event.pointerId);
  const box = bar.getBoundingClientRect();
  const before = CLASSES.slice(0, CLASSES.indexOf(name)).reduce((sum, c) => sum + value().shares[c], 0);
  const move = (e) => setShare(name, (100 * (e.clientX - box.left)) / box.width - before);
  const end = () => {
    handle.removeEventListener("pointermove", move);
    sendSoon();
  };
  handle.addEventListener("pointermove", move);
  handle.addEventListener("lostpointercapture", end, { once: true });
}

/** The slider is logarithmic, with two digits. */
const bpsAt = (t) => Number((MIN_BPS * (MAX_BPS / MIN_BPS) ** t).toPrecision(2));
const placeOf = (bps) => Math.log(bps / MIN_BPS) / Math.log(MAX_BPS / MIN_BPS);

function slide() {
  clearTimeout(timer);
  typed = false;
  order.set(store.vehicle, { ...value(), budget_bps: bpsAt(slider.valueAsNumber) });
}

/** Sends after a pause, since each press of a key releases a slider. */
function sendSoon() {
  clearTimeout(timer);
  timer = setTimeout(send, RELEASE_MS);
}

async function send() {
  const vehicle = store.vehicle;
  if (!order.isChanged(vehicle)) return;
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
  const { error, waiting } = order.progress(vehicle);
  const { budget_bps: bps, shares, background } = value();
  const denied = denial("order");
  for (const part of [form, slider, shareBox, streams.node]) part.inert = denied !== null;
  show(deniedLine, denied !== null);
  text(deniedLine, denied ?? "");
  if (!typed) number.value = bps;
  if (document.activeElement !== slider || !order.isChanged(vehicle)) slider.value = placeOf(bps);
  slider.setAttribute("aria-valuetext", rate(bps));
  refreshShares(shares);
  refreshBrings(vehicle);
  streams.refresh(background);
  text(errorLine, error ?? "");
  replaced.update(vehicle);
  const slot = slotOf(vehicle, "budget");
  show(status.node, slot !== null || waiting !== null);
  status.update(slot, waiting);
}

/** What a share brings now, and what it would bring as it is edited. */
function refreshBrings(vehicle) {
  const [now, then] = [read(), value()].map((at) => bought(vehicle, at));
  for (const [c, node] of Object.entries(brings)) {
    show(node, now !== null);
    if (now !== null) text(node, broughtText(then[c], now[c]));
  }
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
