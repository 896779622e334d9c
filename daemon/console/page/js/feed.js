// The stream of changes, re-opened with a growing pause when it drops or falls quiet.

import { logInIfAsked } from "./api.js";
import { store } from "./store.js";

const QUIET_MS = 6000;
const FIRST_PAUSE_MS = 500;
const LONGEST_PAUSE_MS = 15000;

let source = null;
let pauseMs = FIRST_PAUSE_MS;
let heardMs = 0;
let timer = 0;

export function startFeed() {
  open();
  setInterval(() => {
    if (source && performance.now() - heardMs > QUIET_MS) dropped();
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
  heardMs = performance.now();
  source = new EventSource("/api/v1/events");
  source.addEventListener("state", (event) => {
    opened();
    store.take(JSON.parse(event.data));
  });
  source.addEventListener("map", (event) => {
    heardMs = performance.now();
    const { vehicle, version } = JSON.parse(event.data);
    if (store.snapshot) store.wantMap(vehicle, { version, epoch: store.maps.get(vehicle)?.epoch ?? 0 });
  });
  source.addEventListener("error", dropped);
}

function opened() {
  heardMs = performance.now();
  if (store.connected) return;
  pauseMs = FIRST_PAUSE_MS;
  setFeed("open", 0);
}

function dropped() {
  source?.close();
  source = null;
  logInIfAsked();
  clearTimeout(timer);
  timer = setTimeout(open, pauseMs);
  setFeed("lost", performance.now() + pauseMs);
  pauseMs = Math.min(LONGEST_PAUSE_MS, pauseMs * 2);
}

function setFeed(state, retryMs) {
  const sinceMs = store.feed.state === state ? store.feed.sinceMs : performance.now();
  store.feed = { state, sinceMs, retryMs };
  document.body.dataset.feed = state;
  store.tell("feed");
}
