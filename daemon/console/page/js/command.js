// The principal of this page, who has command, and the actions that both allow.

import { client, readPrincipal, sendCommand } from "./api.js";
import { store } from "./store.js";

const ROLES = ["viewer", "operator", "administrator"];
/** Between two signs of presence; the surface waits 120 s for one. */
const KEEP_MS = 30000;

let me = null;
let keptMs = -KEEP_MS;

export const principal = () => me;
export const holder = () => store.snapshot?.command?.holder ?? null;
const isHolder = () => me !== null && !store.replay && holder()?.name === me.name;
const isHere = () => (holder().client ?? client) === client;
export const hasCommand = () => isHolder() && isHere();
/** Whether our principal has command at another client. */
export const isElsewhere = () => isHolder() && !isHere();
export const rank = (role) => ROLES.indexOf(role);

/** Reads the principal now, and after each interruption; signs of presence follow the keyboard and the pointer. */
export function startPrincipal() {
  let connected = false;
  store.on("feed", () => {
    if (store.connected && !connected) identify();
    connected = store.connected;
  });
  for (const event of ["pointerdown", "keydown"]) addEventListener(event, keep, { capture: true, passive: true });
}

async function identify() {
  try {
    me = await readPrincipal();
  } catch {
    // The server checks every order in any case.
    return;
  }
  store.emit("edit");
}

function keep() {
  const isShared = (store.snapshot?.command?.principals.length ?? 0) > 1;
  if (!isShared || !hasCommand() || performance.now() - keptMs < KEEP_MS) return;
  keptMs = performance.now();
  sendCommand("keep").catch(() => {});
}

/** Why a record takes no order. */
const RECORD = "This is a record: it takes no orders.";

/** Why this page must not give an order of a kind now, or null. `kind`: stop (hold, abort), record (what stays at the surface), order
 * or settings. */
export function denial(kind) {
  if (store.replay) return RECORD;
  if (!me) return null;
  if (kind !== "record" && store.snapshot?.mission.ended) return "The mission has ended: the vehicle takes no more orders.";
  const least = kind === "settings" ? "administrator" : "operator";
  if (rank(me.role) < rank(least)) return `This needs the role ${least}; yours is ${me.role}.`;
  if (["stop", "record"].includes(kind) || holder() === null || hasCommand()) return null;
  const { name } = holder();
  return isElsewhere() ? `${name} has command at another client: take it in the bar at the top.` : `${name} has command: request it in the bar at the top.`;
}

/** Disables all controls in `part` of the page that edit an order, while the page shows a record; those that match `kept` stay. */
export function lockInRecord(part, kept = "[role=tab]") {
  if (!store.replay) return;
  for (const control of part.querySelectorAll("button, input, select")) {
    if (control.matches(kept)) continue;
    control.disabled = true;
    control.title = RECORD;
  }
}
