// The HTTP API of the daemon: reads, and writes that carry the header the server asks for.

const BASE = "/api/v1";

export class Refused extends Error {}

async function read(path) {
  const answer = await fetch(BASE + path, { cache: "no-store", signal: AbortSignal.timeout(10000) });
  const said = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Refused(said.error ?? `${answer.status} ${answer.statusText}`);
  return said;
}

async function write(path, body) {
  let answer;
  try {
    answer = await fetch(BASE + path, {
      method: "POST",
      headers: { "content-type": "application/json", "x-scenecast": "1" },
      body: JSON.stringify(body),
      signal: AbortSignal.timeout(10000),
    });
  } catch {
    throw new Refused("scenecast did not answer; nothing was sent");
  }
  const said = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Refused(said.error ?? `refused with status ${answer.status}`);
  return said;
}

export const sendUtility = (id, utility) => write(`/vehicles/${id}/utility`, utility);
/** `what`: another, larger or cancel; `picture`: the number of the one to enlarge. */
export const askExemplar = (id, label, what, picture = null) =>
  write(`/vehicles/${id}/exemplars`, { label, what, ...(picture && { picture }) });
export const sendConstraints = (id, order) => write(`/vehicles/${id}/constraints`, order);
export const sendFence = (id, fence) => write(`/vehicles/${id}/fence`, fence);
export const sendLimits = (id, limits) => write(`/vehicles/${id}/limits`, limits);
export const sendPlanner = (id, planner) => write(`/vehicles/${id}/settings`, { planner });
export const sendSettings = (id, settings) => write(`/vehicles/${id}/settings`, settings);
/** The settings that tell most within so many bits a second; null: within the map's share of the vehicle's budget. */
export const readFit = (id, bps) => read(`/vehicles/${id}/fit${bps === null ? "" : `?bits_per_s=${bps}`}`);
/** `shares` in percent by class, `spend` what left-over bits go to, in order; null leaves them as they are. */
export const sendBudget = (bps, shares = null, spend = null) =>
  write("/budget", { budget_bps: bps, ...(shares && { shares }), ...(spend && { spend }) });

/** Goes to the login if the surface takes a token and no longer knows ours. */
export async function logInIfAsked() {
  const answer = await fetch(`${BASE}/state`, { cache: "no-store", signal: AbortSignal.timeout(10000) }).catch(() => null);
  if (answer?.status === 401) location.assign("/login");
}

/** The map of a vehicle with its planes as typed arrays, rows from the south. */
export async function readMap(id) {
  const m = await read(`/vehicles/${id}/map`);
  const labels = decode(m.labels);
  const age = ages(m.age_s);
  if (labels.length !== m.width * m.height || age.length !== labels.length) {
    throw new Refused("the map's planes do not fit its size");
  }
  const planes = (m.planes ?? []).map((p) => ({ ...p, data: decode(p.data), age: p.age_s ? ages(p.age_s) : null }));
  return { ...m, labels, age, planes };
}

/** Seconds, two bytes each, the low one first; 65535 = never. */
function ages(base64) {
  const raw = decode(base64);
  const age = new Uint16Array(raw.length / 2);
  for (let i = 0; i < age.length; i += 1) age[i] = raw[2 * i] | (raw[2 * i + 1] << 8);
  return age;
}

function decode(base64) {
  const text = atob(base64);
  const out = new Uint8Array(text.length);
  for (let i = 0; i < out.length; i += 1) out[i] = text.charCodeAt(i);
  return out;
}
