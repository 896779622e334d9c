// The exemplars of a label: request them, follow their arrival, view them, request more, cancel.

import { requestExemplar } from "../api.js";
import { denial } from "../command.js";
import { $, h, show, text } from "../dom.js";
import { ago, bytes, percent } from "../format.js";
import { nameOf } from "../book.js";
import { slotOf } from "../order/status.js";
import { ageOf, missionKey, store } from "../store.js";

const NAMES = { queued: "Queued", on_air: "On air", not_available: "None yet", receiving: "Receiving", refused: "Refused" };
const PENDING = ["queued", "on_air", "not_available", "receiving"];
const errors = new Map();
/** Time after which the ages in the dialog are written again. */
const REDRAW_MS = 10_000;
let viewer = null;

export function exemplar(of) {
  const ask = h("button.request", { type: "button", onclick: () => request(of()) }, "Request");
  const image = h("button.image", { type: "button", onclick: () => viewExemplars(of()) }, h("img", { alt: "", width: 44, height: 44 }));
  const state = h("span.state");
  const bar = h("progress", { max: 1 });
  const cancel = h("button.cancel", { type: "button", onclick: () => request(of(), "cancel") }, "Cancel");
  const box = h("div.exemplar", {}, ask, image, state, bar, cancel);
  box.parts = { ask, image, state, bar, cancel };
  return box;
}

/** `action`: another, larger (of `image`) or cancel. */
async function request(label, action = "another", image = null) {
  const key = `${store.selectedId}.${label.id}`;
  try {
    errors.delete(key);
    await requestExemplar(store.selectedId, label.id, action, image);
  } catch (error) {
    errors.set(key, error.message);
  }
  store.emit("edit");
}

function hintOf(e) {
  if (e.state === "not_available") return "The vehicle has no such image yet and will send one as soon as it has it";
  return e.state === "receiving" ? `${percent(e.progress)} of the image has arrived` : "";
}

export function refreshExemplar(box, label, name) {
  const e = label.exemplar;
  const { ask, image, state, bar, cancel } = box.parts;
  const error = errors.get(`${store.selectedId}.${label.id}`);
  const received = e.url !== null;
  const pending = PENDING.includes(e.state);
  show(image, received);
  const denied = denial("order");
  for (const button of [ask, cancel]) {
    button.disabled = denied !== null;
    button.title = denied ?? "";
  }
  show(ask, !received && !pending);
  text(ask, e.state === "refused" ? "Request again" : "Request");
  ask.setAttribute("aria-label", `${ask.textContent}: an image of ${name}`);
  show(state, error !== undefined || pending || e.state === "refused");
  text(state, error ?? NAMES[e.state] ?? "");
  const why = e.state === "refused" ? slotOf(store.vehicle, "requests")?.reason : null;
  state.title = error ?? why ?? hintOf(e);
  state.dataset.state = error ? "refused" : e.state;
  // Beside an image there is no room for them: the dialog of the image shows both.
  show(bar, e.state === "receiving" && !received);
  bar.value = e.progress;
  bar.setAttribute("aria-label", `Image of ${name}`);
  show(cancel, pending && !received);
  cancel.setAttribute("aria-label", `Cancel the image of ${name}`);
  if (viewer?.id === label.id) viewer.refresh(label);
  if (!received) return;
  const img = image.firstElementChild;
  const latest = e.images.at(-1);
  const url = `${latest.url}?at=${latest.at_s}`;
  if (img.getAttribute("src") !== url) img.src = url;
  image.setAttribute("aria-label", `Image of ${name}, enlarge`);
}

/** The dialog with all images of a label. */
export function viewExemplars(label) {
  const dialog = $("dialog");
  const close = () => dialog.close();
  const shown = h("div.images");
  const another = h("button", { type: "button", onclick: () => request(viewer.label) }, "Another");
  const cancel = h("button", { type: "button", onclick: () => request(viewer.label, "cancel") }, "Cancel");
  const state = h("p.state", { role: "status" });
  const mission = missionKey(store.vehicle);
  let drawnAt = performance.now();
  const refresh = (now) => {
    if (missionKey(store.vehicle) !== mission) return close();
    viewer.label = now;
    const e = now.exemplar;
    const pending = PENDING.includes(e.state);
    text(state, errors.get(`${store.selectedId}.${now.id}`) ?? (pending ? `${NAMES[e.state]}${e.state === "receiving" ? ` ${percent(e.progress)}` : ""}` : ""));
    show(cancel, pending);
    for (const button of [another, cancel]) button.disabled = denial("order") !== null;
    const key = e.images.map((i) => `${i.url}${i.at_s}`).join() + pending;
    // The captions tell ages.
    if (shown.dataset.key === key && performance.now() - drawnAt < REDRAW_MS) return;
    [shown.dataset.key, drawnAt] = [key, performance.now()];
    shown.replaceChildren(...[...e.images].reverse().map((i) => figure(now, i, pending)));
  };
  viewer = { id: label.id, label, refresh };
  dialog.replaceChildren(h("h2", { id: "dialog-title" }, nameOf(label.id)), shown, state,
    h("div.buttons", {}, another, cancel, h("button.primary", { type: "button", onclick: close }, "Close")));
  dialog.addEventListener("close", () => (viewer = null), { once: true });
  refresh(label);
  dialog.showModal();
}

/** One image with its size and age, and the button that requests a larger one. */
function figure(label, image, pending) {
  const unrequested = image.requested ? "" : ", not requested";
  const larger = h("button", { type: "button", onclick: () => request(label, "larger", image.number), disabled: denial("order") !== null }, "Larger");
  show(larger, image.can_enlarge && !pending);
  larger.setAttribute("aria-label", `Larger: image ${image.number} of ${nameOf(label.id)}`);
  const { taken_s: taken = null, width_m: width = null } = image;
  const when = taken === null ? `received ${ago(ageOf(image.at_s))}` : `taken ${ago(ageOf(taken))}, received ${ago(ageOf(image.at_s))}`;
  const where = width === null ? "" : `${metres(width)} wide, E ${image.x_m.toFixed(1)} N ${image.y_m.toFixed(1)} m; `;
  return h("figure", {},
    h("img.large", { src: `${image.url}?at=${image.at_s}`, alt: `Representative image of ${nameOf(label.id)}` }),
    width === null ? "" : scale(width),
    h("figcaption", {}, `${where}${image.edge_px} px, ${bytes(image.bytes)}${unrequested}, ${when}. `, larger));
}

/** A length of an image: centimetres below a metre. */
function metres(m) {
  return m < 0.995 ? `${Number((m * 100).toPrecision(2))} cm` : `${Number(m.toPrecision(2))} m`;
}

/** A scale bar below an image that is so wide: a round length of at most half of the width. */
function scale(width) {
  const power = 10 ** Math.floor(Math.log10(width / 2));
  const length = [5, 2, 1].map((n) => n * power).find((m) => m <= (width / 2) * 1.000001) ?? power;
  const bar = h("div.scale", {}, metres(length));
  bar.style.width = `calc(min(320px, 80vw) * ${length / width})`;
  return bar;
}
