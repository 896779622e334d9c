// The play head of a record. It is at the server and shared by all pages; what this page has asked for is shown at once.

import { sendReplay } from "./api.js";
import { store } from "./store.js";

/** Between two changes, so that a dragged slider is at most five a second. */
const PACE_MS = 200;

/** Changes that are not sent yet, and those that are on their way. */
let waiting = {};
let sent = null;
let timer = 0;
let lastMs = -PACE_MS;
let fault = null;

/** The replay as it will be once the server has this page's changes; null on a live surface. */
export const playHead = () => store.replay && { ...store.replay, ...sent, ...waiting };

/** Why the last change failed, or null. */
export const playFault = () => fault;

/** Changes any of at_utc_s, is_playing, speed and side. Later changes replace those that wait. */
export function change(order) {
  Object.assign(waiting, order);
  store.emit("replay");
  sendSoon();
}

/** Shows another moment, as far as the record has it. */
export function seek(atUtcS) {
  const { from_utc_s: from, to_utc_s: to } = store.replay;
  change({ at_utc_s: Math.min(to, Math.max(from, atUtcS)) });
}

/** One change is on its way at a time, so that none overtakes a later one. */
function sendSoon() {
  if (timer || sent || Object.keys(waiting).length === 0) return;
  timer = setTimeout(send, Math.max(0, lastMs + PACE_MS - performance.now()));
}

async function send() {
  [timer, lastMs, fault] = [0, performance.now(), null];
  [sent, waiting] = [waiting, {}];
  try {
    const replay = await sendReplay(sent);
    if (store.replay) store.snapshot.replay = replay;
  } catch (error) {
    fault = error.message;
  }
  sent = null;
  store.emit("replay");
  sendSoon();
}
