// The representative pictures of a label: ask, follow the life line, look at them, ask for more or none.

import { askExemplar } from "../api.js";
import { $, h, show, text } from "../dom.js";
import { ago, bytes, percent } from "../format.js";
import { nameOf } from "../book.js";
import { ageOf, store } from "../store.js";
import { slotOf } from "./lifeline.js";

const WORDS = { queued: "Queued", on_air: "On air", none_yet: "None yet", coming: "Coming", refused: "Refused" };
const UNDER_WAY = ["queued", "on_air", "none_yet", "coming"];
const errors = new Map();
let looking = null;

export function exemplar(of) {
  const ask = h("button.ask", { type: "button", onclick: () => request(of()) }, "Show me");
  const picture = h("button.picture", { type: "button", onclick: () => look(of()) }, h("img", { alt: "", width: 44, height: 44 }));
  const state = h("span.state");
  const bar = h("progress", { max: 1 });
  const cancel = h("button.cancel", { type: "button", onclick: () => request(of(), "cancel") }, "Cancel");
  const box = h("div.exemplar", {}, ask, picture, state, bar, cancel);
  box.parts = { ask, picture, state, bar, cancel };
  return box;
}

/** `what`: another, larger (of `picture`) or cancel. */
async function request(label, what = "another", picture = null) {
  const key = `${store.selectedId}.${label.id}`;
  try {
    errors.delete(key);
    await askExemplar(store.selectedId, label.id, what, picture);
  } catch (error) {
    errors.set(key, error.message);
  }
  store.tell("draft");
}

export function refreshExemplar(box, label, name) {
  const e = label.exemplar;
  const { ask, picture, state, bar, cancel } = box.parts;
  const error = errors.get(`${store.selectedId}.${label.id}`);
  const here = e.url !== null;
  const waits = UNDER_WAY.includes(e.state);
  show(picture, here);
  show(ask, !here && !waits);
  text(ask, e.state === "refused" ? "Ask again" : "Show me");
  ask.setAttribute("aria-label", `${ask.textContent}: a picture of ${name}`);
  show(state, error !== undefined || waits || e.state === "refused");
  const done = e.state === "coming" ? ` ${percent(e.progress)}` : "";
  text(state, error ?? `${WORDS[e.state] ?? ""}${done}`);
  const why = e.state === "refused" ? slotOf(store.vehicle, "requests")?.reason : null;
  state.title = error ?? why ?? (e.state === "none_yet" ? "The vehicle has no such picture yet, and sends it when it has" : "");
  state.dataset.state = error ? "refused" : e.state;
  show(bar, e.state === "coming");
  bar.value = e.progress;
  bar.setAttribute("aria-label", `Picture of ${name}`);
  show(cancel, waits);
  cancel.setAttribute("aria-label", `Cancel the picture of ${name}`);
  if (looking?.id === label.id) looking.refresh(label);
  if (!here) return;
  const img = picture.firstElementChild;
  const newest = e.pictures.at(-1);
  const url = `${newest.url}?at=${newest.at_s}`;
  if (img.getAttribute("src") !== url) img.src = url;
  picture.setAttribute("aria-label", `Picture of ${name}, enlarge`);
}

function look(label) {
  const dialog = $("dialog");
  const close = () => dialog.close();
  const shown = h("div.pictures");
  const another = h("button", { type: "button", onclick: () => request(looking.label) }, "Another");
  const cancel = h("button", { type: "button", onclick: () => request(looking.label, "cancel") }, "Cancel");
  const state = h("p.state", { role: "status" });
  const refresh = (now) => {
    looking.label = now;
    const e = now.exemplar;
    const waits = UNDER_WAY.includes(e.state);
    text(state, errors.get(`${store.selectedId}.${now.id}`) ?? (waits ? `${WORDS[e.state]}${e.state === "coming" ? ` ${percent(e.progress)}` : ""}` : ""));
    show(cancel, waits);
    const key = e.pictures.map((p) => `${p.url}${p.at_s}`).join() + waits;
    if (shown.dataset.key === key) return;
    shown.dataset.key = key;
    shown.replaceChildren(...[...e.pictures].reverse().map((p) => figure(now, p, waits)));
  };
  looking = { id: label.id, label, refresh };
  dialog.replaceChildren(h("h2", { id: "dialog-title" }, nameOf(label.id)), shown, state,
    h("div.buttons", {}, another, cancel, h("button.primary", { type: "button", onclick: close }, "Close")));
  dialog.addEventListener("close", () => (looking = null), { once: true });
  refresh(label);
  dialog.showModal();
}

/** One picture with where it comes from, and the way to a larger one. */
function figure(label, p, waits) {
  const unasked = p.asked ? "" : ", unasked";
  const larger = h("button", { type: "button", onclick: () => request(label, "larger", p.picture) }, "Larger");
  show(larger, p.can_grow && !waits);
  larger.setAttribute("aria-label", `Larger: picture ${p.picture} of ${nameOf(label.id)}`);
  return h("figure", {},
    h("img.large", { src: `${p.url}?at=${p.at_s}`, alt: `Representative picture of ${nameOf(label.id)}` }),
    h("figcaption", {}, `${p.edge_px} px, ${bytes(p.bytes)}${unasked}, received ${ago(ageOf(p.at_s))}. `, larger));
}
