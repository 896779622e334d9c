// The representative picture of a label: ask, follow its life line, look at it.

import { askExemplar } from "../api.js";
import { $, h, show, text } from "../dom.js";
import { ago, bytes, percent } from "../format.js";
import { nameOf } from "../book.js";
import { ageOf, store } from "../store.js";
import { slotOf } from "./lifeline.js";

const WORDS = { queued: "Queued", on_air: "On air", coming: "Coming", refused: "Refused" };
const errors = new Map();

export function exemplar(of) {
  const ask = h("button.ask", { type: "button", onclick: () => request(of()) }, "Show me");
  const picture = h("button.picture", { type: "button", onclick: () => look(of()) }, h("img", { alt: "", width: 44, height: 44 }));
  const state = h("span.state");
  const bar = h("progress", { max: 1 });
  const box = h("div.exemplar", {}, ask, picture, state, bar);
  box.parts = { ask, picture, state, bar };
  return box;
}

async function request(label) {
  const key = `${store.selectedId}.${label.id}`;
  try {
    errors.delete(key);
    await askExemplar(store.selectedId, label.id);
  } catch (error) {
    errors.set(key, error.message);
  }
  store.tell("draft");
}

export function refreshExemplar(box, label, name) {
  const e = label.exemplar;
  const { ask, picture, state, bar } = box.parts;
  const error = errors.get(`${store.selectedId}.${label.id}`);
  const here = e.state === "here" && e.url !== null;
  show(picture, here);
  show(ask, e.state === "none" || e.state === "refused");
  text(ask, e.state === "refused" ? "Ask again" : "Show me");
  ask.setAttribute("aria-label", `${ask.textContent}: a picture of ${name}`);
  show(state, error !== undefined || (!here && e.state !== "none"));
  const done = e.state === "coming" ? ` ${percent(e.progress)}` : "";
  text(state, error ?? `${WORDS[e.state] ?? ""}${done}`);
  const why = e.state === "refused" ? slotOf(store.vehicle, "requests")?.reason : null;
  state.title = error ?? why ?? "";
  state.dataset.state = error ? "refused" : e.state;
  show(bar, e.state === "coming");
  bar.value = e.progress;
  bar.setAttribute("aria-label", `Picture of ${name}`);
  if (!here) return;
  const img = picture.firstElementChild;
  const url = `${e.url}?at=${e.at_s}`;
  if (img.getAttribute("src") !== url) img.src = url;
  picture.setAttribute("aria-label", `Picture of ${name}, enlarge`);
}

function look(label) {
  const e = label.exemplar;
  const dialog = $("dialog");
  const close = () => dialog.close();
  dialog.replaceChildren(
    h("h2", { id: "dialog-title" }, nameOf(label.id)),
    h("img.large", { src: `${e.url}?at=${e.at_s}`, alt: `Representative picture of ${nameOf(label.id)}` }),
    h("p", {}, `${bytes(e.bytes)}, received ${ago(ageOf(e.at_s))}.`),
    h("div.buttons", {},
      h("button", { type: "button", onclick: () => (request(label), close()) }, "Ask again"),
      h("button.primary", { type: "button", onclick: close }, "Close")),
  );
  dialog.showModal();
}
