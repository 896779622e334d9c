// The stream of server-sent events. It is opened again, after a growing pause, when it breaks off or falls silent.

import { BASE, logInIfRequired } from "./api.js";
import { store } from "./store.js";

const SILENCE_TIMEOUT_MS = 6000;
const MIN_PAUSE_MS = 500;
const MAX_PAUSE_MS = 15000;

let source = null;
let pauseMs = MIN_PAUSE_MS;
let receivedMs = 0;
let timer = 0;

export function startFeed() {
  open();
  setInterval(() => {
    if (source && performance.now() - receivedMs > SILENCE_TIMEOUT_MS) drop();
  }, 1000);
  addEventListener("online", retryNow);
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden && !source) retryNow();
  });
}

export function retryNow() {
  if (source) return;
  clearTimeout(timer);
  open();
}

function open() {
  receivedMs = performance.now();
  source = new EventSource(`${BASE}/events`);
  source.addEventListener("state", (event) => {
    confirmOpen();
    store.setSnapshot(JSON.parse(event.data));
  });
  source.addEventListener("map", (event) => {
    receivedMs = performance.now();
    const { vehicle, version } = JSON.parse(event.data);
    if (store.snapshot) store.fetchMap(vehicle, { version, epoch: store.maps.get(vehicle)?.epoch ?? 0 });
  });
  source.addEventListener("error", drop);
}

function confirmOpen() {
  receivedMs = performance.now();
  if (store.connected) return;
  pauseMs = MIN_PAUSE_MS;
  setFeed("open", 0);
}

function drop() {
  source?.close();
  source = null;
  logInIfRequired();
  clearTimeout(timer);
  timer = setTimeout(open, pauseMs);
  setFeed("lost", performance.now() + pauseMs);
  pauseMs = Math.min(MAX_PAUSE_MS, pauseMs * 2);
}

function setFeed(state, retryMs) {
  const sinceMs = store.feed.state === state ? store.feed.sinceMs : performance.now();
  store.feed = { state, sinceMs, retryMs };
  document.body.dataset.feed = state;
  store.emit("feed");
}
