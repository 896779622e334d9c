// The HTTP API of the daemon: reads, and orders with the header that the server requires.

import { recall, remember } from "./prefs.js";
import { parseTiles } from "./tiles.js";

export const BASE = "/api/v2";
const TIMEOUT_MS = 10000;
/** A whole map may have some megabytes. */
const MAP_TIMEOUT_MS = 60000;

/** The name of this browser: command belongs to the client that took it. */
export const client = recall("client", null) ?? `page-${crypto.getRandomValues(new Uint32Array(1))[0].toString(16).padStart(8, "0")}`;
remember("client", client);

/** The message is one line for people. */
export class ApiError extends Error {}

async function read(path) {
  const response = await fetch(BASE + path, { cache: "no-store", signal: AbortSignal.timeout(TIMEOUT_MS) });
  if (response.ok) return response.json();
  const { error } = await response.json().catch(() => ({}));
  throw new ApiError(error ?? `${response.status} ${response.statusText}`);
}

async function write(path, order) {
  let response;
  try {
    response = await fetch(BASE + path, {
      method: "POST",
      headers: { "content-type": "application/json", "x-scenecast": "1", "x-scenecast-client": client },
      body: JSON.stringify(order),
      // An order is sent even if the page is closed or loaded again at once.
      keepalive: true,
      signal: AbortSignal.timeout(TIMEOUT_MS),
    });
  } catch {
    throw new ApiError("scenecast did not answer; the order was not sent");
  }
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new ApiError(body.error ?? `refused with status ${response.status}`);
  return body;
}

/** The operator's name, colour and merging of a label; null takes one away. They stay at the surface. */
export const saveLabel = (id, label) => write(`/vehicles/${id}/labels`, label);
/** Sets a marker at metres east and north in the world frame. It stays at the surface. */
export const addMarker = (id, x, y, text) => write(`/vehicles/${id}/markers`, { x_m: x, y_m: y, text });
export const removeMarker = (id, number) => write(`/vehicles/${id}/markers/remove`, { number });
/** Shows the current map in place of that of an earlier run. */
export const dismissEarlierMap = (id) => write(`/vehicles/${id}/earlier-map/dismiss`, {});
/** The maps of runs that have ended, the newest first. */
export const readArchive = async () => (await read("/archive")).maps;
/** The images of the sea floor that have arrived after version `since`, and the version of the last. */
export const readFloor = (id, since) => read(`/vehicles/${id}/floor?since=${since}`);
/** The labels that a cell had before: {label, until_s}, the newest first. */
export const readCellHistory = async (id, x, y) => (await read(`/vehicles/${id}/cells/${x}/${y}`)).former;
/** The entries of the mission's log after number `since`, the oldest first. */
export const readLog = async (since) => (await read(`/log?since=${since}`)).entries;
/** Keeps weights that are not sent; `exploration` and `curiosity` may be null. They stay at the surface. */
export const keepDraft = (id, draft) => write(`/vehicles/${id}/draft`, draft);
/** What the vehicle would do by these weights; nothing is sent to it. */
export const dryRun = (id, utility) => write(`/vehicles/${id}/dry-run`, utility);
export const sendUtility = (id, utility) => write(`/vehicles/${id}/utility`, utility);
/** `action`: another, larger or cancel; `image`: the number of the image to enlarge. */
export const requestExemplar = (id, label, action, image = null) =>
  write(`/vehicles/${id}/exemplars`, { label, action, ...(image && { image }) });
/** Gives a withdrawn order again, as a new one. */
export const giveAgain = (id, slot) => write(`/vehicles/${id}/orders/again`, { slot });
/** Sends the orders again that the vehicle has lost. */
export const restoreOrders = (id) => write(`/vehicles/${id}/orders/restore`, {});
/** Takes the vehicle over from another surface. */
export const takeOver = (id) => write(`/vehicles/${id}/take-over`, {});
export const sendConstraints = (id, order) => write(`/vehicles/${id}/constraints`, order);
export const sendFence = (id, fence) => write(`/vehicles/${id}/fence`, fence);
/** `areas`: [{ outline: [[x, y], ..], weight }]. */
export const sendAreas = (id, areas) => write(`/vehicles/${id}/areas`, { areas });
/** `place`: [x, y], or null to withdraw the destination. */
export const sendDestination = (id, place) => write(`/vehicles/${id}/destination`, { place });
export const sendLimits = (id, limits) => write(`/vehicles/${id}/limits`, limits);
export const sendSettings = (id, settings) => write(`/vehicles/${id}/settings`, settings);
/** The most informative settings within `bps` bit/s; null: within the map's share of the vehicle's budget. */
export const readFit = (id, bps) => read(`/vehicles/${id}/fit${bps === null ? "" : `?bits_per_s=${bps}`}`);
/** `shares` in percent by class; `background`: the streams that use spare capacity, in order. Null leaves them unchanged. */
export const sendBudget = (bps, shares = null, background = null) =>
  write("/budget", { budget_bps: bps, ...(shares && { shares }), ...(background && { background }) });

/** The events of a record: {at_utc_s, kind, vehicle, text}, in the order of their times. */
export const readReplayEvents = async () => (await read("/replay/events")).events;
/** `change`: any of at_utc_s, is_playing, speed and side. Resolves to the replay as it is then. */
export const sendReplay = (change) => write("/replay", change);

export const readPrincipal = () => read("/principal");
/** `action`: request, withdraw, take, hand_over (to `to`), release or keep. */
export const sendCommand = (action, to = null) => write("/command", { action, ...(to && { to }) });
export const logOut = () => fetch("/logout", { method: "POST", headers: { "x-scenecast": "1" }, redirect: "manual" });

/** Opens the login form if the surface requires a token and our session is not valid. */
export async function logInIfRequired() {
  const response = await fetch(`${BASE}/state`, { cache: "no-store", signal: AbortSignal.timeout(TIMEOUT_MS) }).catch(() => null);
  if (response?.status === 401) location.assign("/login");
}

/** The tiles of a vehicle's map that have changed since the map with the tag `since`, or all of them. */
export async function readTiles(id, since) {
  const query = since ? `?since=${encodeURIComponent(since)}` : "";
  const response = await fetch(`${BASE}/vehicles/${id}/map/tiles${query}`, { cache: "no-store", signal: AbortSignal.timeout(MAP_TIMEOUT_MS) });
  if (!response.ok) {
    const body = await response.json().catch(() => ({}));
    throw new ApiError(body.error ?? `${response.status} ${response.statusText}`);
  }
  return parseTiles(await response.arrayBuffer());
}
