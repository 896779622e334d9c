// A stand-in for the daemon: serves the page and /api/v2 with a synthetic mission.
//
//   node mock/server.mjs [--port 8470] [--scenario rich|empty|start|silent|refused|two|big|wide|replay]
//
// Here the mission follows the clock. In stories it advances only when they say so, so that nothing changes between two reads.
//
// POST /mock controls it in tests:
//   {"scenario": "rich", "advance": 60, "times": 3, "speed": 20, "silent": true, "refuse": "utility",
//    "loss": 0.3, "layers": true, "coarse": true, "without_image": [3], "position": {"x_m": 5, ..},
//    "placement": {"version": 1, "east_m": 20, "north_m": -5}, "contact": {"received_s_ago": 300, "due_s_ago": 290},
//    "registration": {"at_s": 5, "tie": "earlier_track", "share": 1, "sigma_m": 0.04, "closed": 12}, "closed_loops": [[5, 1.5, -2]],
//    "label_at": {"x_m": 5.1, "y_m": -3, "label": 2},
//    "replay": {"sides": ["vehicle"], "further": [{"at_utc_s": .., ..}]},
//    "ended": true, "truth": true, "principals": [{"name": "anna", "role": "operator"}], "commander": "anna", "stream": false, "mute": true, "down": true}

import http from "node:http";
import { readFile } from "node:fs/promises";
import { dirname, extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { Mission } from "./mission.mjs";
import { REFUSAL, Replay } from "./replay.mjs";
import { faultOf, fit } from "./settings.mjs";
import { PICTURE } from "./truth.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const ASSETS = join(HERE, "../../../daemon/console/page");
const TYPES = {
  ".html": "text/html; charset=utf-8", ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml",
  ".js": "text/javascript; charset=utf-8",
};
const POLICY =
  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; " +
  "base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

const missionOf = (scenario) => (scenario === "replay" ? new Replay() : new Mission(scenario));

/** Starts a mock; resolves to {url, close()}. The mission advances by itself if `live`. */
export async function startMock({ port = 0, scenario = "rich", live = false } = {}) {
  const mock = { mission: missionOf(scenario), streams: new Set(), stream: true, down: false, mute: false };
  const server = http.createServer((req, res) => {
    route(mock, req, res).catch((error) => reply(res, error.status ?? 500, { error: error.message }));
  });
  await new Promise((resolve, reject) => {
    server.once("error", reject);
    server.listen(port, "127.0.0.1", resolve);
  });
  // A record that plays has four states a second.
  const pauseS = live && scenario === "replay" ? 0.25 : 1;
  const timer = setInterval(() => {
    if (live) advance(mock, pauseS * mock.mission.speed);
    emit(mock, "state", mock.mission.json());
  }, 1000 * pauseS);
  const close = () => {
    clearInterval(timer);
    for (const s of mock.streams) s.destroy();
    server.closeAllConnections();
    return new Promise((resolve) => server.close(resolve));
  };
  return { url: `http://127.0.0.1:${server.address().port}`, close };
}

function advance(mock, seconds) {
  for (const id of mock.mission.advance(seconds)) {
    const { version } = mock.mission.vehicles.find((v) => v.id === id).replica;
    emit(mock, "map", { vehicle: id, version });
  }
}

function emit(mock, event, data) {
  if (mock.mute) return;
  for (const s of mock.streams) s.write(`event: ${event}\ndata: ${JSON.stringify(data)}\n\n`);
}

async function route(mock, req, res) {
  const { pathname } = new URL(req.url, "http://mock");
  if (pathname === "/mock") return steer(mock, await body(req), res);
  if (mock.down) return req.socket.destroy();
  if (pathname === "/api/v2/events") return subscribe(mock, res);
  if (pathname.startsWith("/api/v2/")) return api(mock, req, res, pathname.slice(8));
  return asset(pathname, res);
}

function subscribe(mock, res) {
  if (!mock.stream) return reply(res, 503, { error: "no streams now" });
  res.writeHead(200, { "content-type": "text/event-stream", "cache-control": "no-store" });
  res.write(`event: state\ndata: ${JSON.stringify(mock.mission.json())}\n\n`);
  mock.streams.add(res);
  res.on("close", () => mock.streams.delete(res));
}

async function api(mock, req, res, path) {
  const { mission } = mock;
  if (req.method === "POST") return post(mock, req, res, path);
  if (mission instanceof Replay && path === "principal") return reply(res, 200, mission.principal());
  if (mission instanceof Replay && path === "replay/events") return reply(res, 200, { events: mission.events() });
  if (path === "principal") return reply(res, 200, mission.command.principal(req.headers.cookie));
  if (path === "state") return reply(res, 200, mission.json());
  if (path === "truth.png" && mission.truth) return send(res, 200, "image/png", PICTURE);
  if (path === "log") {
    const since = Number(new URL(req.url, "http://mock").searchParams.get("since") ?? 0);
    return reply(res, 200, { entries: mission.log.filter((e) => e.number > since) });
  }
  if (path === "log.csv") return send(res, 200, "text/csv", Buffer.from("number,utc,mission_s,vehicle,kind,by,text\n"));
  if (path === "archive") return reply(res, 200, { maps: mission.archive ?? [] });
  const [, id, resource] = path.match(/^vehicles\/(\d+)\/(.+)$/) ?? [];
  const vehicle = mission.vehicles.find((v) => v.id === Number(id));
  if (!vehicle) return reply(res, 404, { error: "no such vehicle" });
  const [, x, y] = resource.match(/^cells\/(-?\d+)\/(-?\d+)$/) ?? [];
  if (x) return reply(res, 200, { former: vehicle.replica.former.filter((f) => f.x === Number(x) && f.y === Number(y)).map(({ label, until_s }) => ({ label, until_s })) });
  if (resource === "map/tiles") return tiles(mock, req, res, vehicle);
  if (resource === "fit") return reply(res, 200, fit(new URL(req.url, "http://mock").searchParams.get("bits_per_s"), mission));
  if (resource.startsWith("map.")) return send(res, 200, "application/octet-stream", Buffer.from(`${resource} of the mock`));
  const [, label] = resource.match(/^exemplars\/(\d+)(-\d+)?\.webp$/) ?? [];
  if (!vehicle.exemplars.get(Number(label))?.images.length) return reply(res, 404, { error: "not received" });
  return send(res, 200, "image/webp", await readFile(join(HERE, `exemplars/${(Number(label) - 1) % 6}.webp`)));
}

/** Tiles in gzip, as the daemon packs them. */
function tiles({ mission }, req, res, vehicle) {
  const since = new URL(req.url, "http://mock").searchParams.get("since");
  const map = mission instanceof Replay ? mission.mapBytes(vehicle, since) : vehicle.mapBytes(mission.nowS, mission.layers ? mission.background : [], since);
  const bytes = gzipSync(map, { level: 1 });
  res.writeHead(200, { "content-type": "application/x-scenecast-tiles", "content-encoding": "gzip", "content-length": bytes.length, "cache-control": "no-store" });
  res.end(bytes);
}

/** A dry run to the east, to the label that is favoured most. */
function dryRun({ weights = {} }) {
  const label = Number(Object.entries(weights).sort(([, a], [, b]) => b - a)[0]?.[0] ?? 1);
  const at = { reason: "label", label };
  return {
    from: [0, 0], legs: [{ to: [6, 0], ...at }, { to: [6, 6], reason: "unseen", label: null }], targets: [[0, 8, 12]],
    first: { ...at, at: [4, 0], along_m: 4, arrival_s: 60 }, metres: 12, at_s: 0,
    text: `With these weights the vehicle would go to label ${label}.`, rests_on: "It rests on the surface's map.",
    pass: { metres: 887, time_s: 1774 },
  };
}

async function post(mock, req, res, path) {
  if (req.headers["x-scenecast"] !== "1") return reply(res, 403, { error: "header X-Scenecast is missing" });
  const { mission } = mock;
  const given = await body(req);
  if (mission instanceof Replay) return replay(mock, res, path, given);
  const by = mission.command.giver(req.headers);
  if (path === "command") {
    const refused = mission.command.act(by, given, mission.nowS);
    reply(res, refused?.[0] ?? 200, refused ? { error: refused[1] } : mission.command.json());
    return emit(mock, "state", mission.json());
  }
  if (path.endsWith("/dry-run")) return reply(res, 200, dryRun(given));
  const isRecord = /\/(labels|draft|notes|dismiss|markers|markers\/remove)$/.test(path);
  const kind = path.endsWith("/settings") ? "settings" : ["hold", "abort"].includes(given.action) ? "stop" : "order";
  const refused = isRecord ? null : mission.command.refusal(by, kind);
  if (refused) return reply(res, refused[0], { error: refused[1] });
  if (!isRecord) mission.command.order(by, kind, mission.nowS);
  if (path === "budget") {
    const bps = given.budget_bps;
    if (!Number.isInteger(bps) || bps < 100 || bps > 100000) {
      return reply(res, 422, { error: "budget_bps must be 100 to 100000" });
    }
    const sum = Object.values(given.shares ?? {}).reduce((a, b) => a + b, 0);
    if (sum > 100) return reply(res, 422, { error: `shares add up to ${sum} percent: allowed is 100 or less` });
    Object.assign(mission, { budgetBps: bps, shares: given.shares ?? mission.shares, background: given.background ?? mission.background });
    mission.handleBudget();
    const versions = mission.vehicles.map((v) => [v.id, v.directive.issue("budget", mission.nowS).version]);
    return accepted(mock, res, { slot: "budget", name: "budget", versions: Object.fromEntries(versions) });
  }
  const [, id, resource] = path.match(/^vehicles\/(\d+)\/([\w-]+)(?:\/(?:dismiss|remove|again|restore))?$/) ?? [];
  const v = mission.vehicles.find((x) => x.id === Number(id));
  if (!v) return reply(res, 404, { error: "no such vehicle" });
  if (resource === "utility") {
    const bad = Object.entries(given.weights ?? {}).find(([, w]) => !(w >= -1 && w <= 1));
    if (bad) return reply(res, 422, { error: `weight of label ${bad[0]} must be -1 to 1` });
    return accepted(mock, res, mission.utility(v, given));
  }
  // The mock keeps no names: the browser's copy counts.
  if (resource === "labels") return reply(res, 200, {});
  if (resource === "draft") {
    v.draft = { exploration: null, curiosity: null, ...given, number: v.draft.number + 1, at_s: mission.nowS, author: by.name };
    return accepted(mock, res, {});
  }
  if (resource === "markers") {
    v.mark(path.endsWith("/remove") ? { remove: given.number } : { ...given, author: by.name }, mission.nowS);
    return accepted(mock, res, {});
  }
  if (resource === "earlier-map") {
    v.earlier = null;
    return accepted(mock, res, {});
  }
  if (resource === "exemplars") return accepted(mock, res, v.request(given, mission.nowS));
  if (resource === "orders" && path.endsWith("/again")) return accepted(mock, res, v.directive.again(given.slot, mission.nowS));
  if (resource === "orders") {
    for (const slot of v.directive.json().slots) if (slot.asks && slot.name !== "resume") v.directive.again(slot.slot, mission.nowS);
    return accepted(mock, res, {});
  }
  if (resource === "take-over") {
    v.otherSurface.is_taken_over = true;
    return accepted(mock, res, {});
  }
  if (resource === "constraints") {
    return accepted(mock, res, v.directive.issue("constraints", mission.nowS, (s) => {
      if (s === "applied") Object.assign(v, { hold: given.action === "hold", aborted: given.action === "abort" });
    }, given.action));
  }
  if (resource === "settings") {
    const wrong = faultOf(given);
    if (wrong) return reply(res, 422, { error: wrong });
    const last = v.directive.slots.get("settings")?.state;
    v.settings.request(given, last);
    if ("planner" in given) v.planner = given.planner || null;
    return accepted(mock, res, v.directive.issue("settings", mission.nowS, (s) => v.settings.finish(s)));
  }
  const orders = { fence: () => fence({ ...v.fence, ...given }), limits: () => limits({ ...v.limits, ...given }), areas: () => given, destination: () => given };
  if (resource in orders) {
    const order = orders[resource]();
    v[resource] = order;
    const response = v.directive.issue(resource, mission.nowS, (s) => {
      if (s === "applied") v.inForce[resource] = { version: response.version, order };
    });
    return accepted(mock, res, response);
  }
  return reply(res, 404, { error: "no such thing" });
}

function replay(mock, res, path, given) {
  const { mission } = mock;
  if (path !== "replay") return reply(res, 403, { error: REFUSAL });
  const refused = mission.change(given);
  reply(res, refused ? 422 : 200, refused ? { error: refused } : mission.replay());
  emit(mock, "state", mission.json());
}

const fence = (f) => ({ fence: f.fence ?? null, keep_outs: f.keep_outs ?? [], return_point: f.return_point ?? null });

function limits(given) {
  const names = ["depth_m", "altitude_m", "distance_m", "time_s", "silence_s", "on_silence", "on_breach", "on_abort"];
  return Object.fromEntries(names.map((n) => [n, given[n] ?? null]));
}

function accepted(mock, res, response) {
  reply(res, 202, response);
  emit(mock, "state", mock.mission.json());
}

function steer(mock, order, res) {
  if (order.scenario) mock.mission = missionOf(order.scenario);
  if (order.replay) Object.assign(mock.mission, order.replay);
  const { mission } = mock;
  if ("in_force" in order) mission.vehicles[0].knownInForce = order.in_force;
  if (order.contact) mission.vehicles[0].setContact(mission.nowS, order.contact);
  if ("registration" in order) mission.vehicles[0].registration = order.registration;
  if ("closed_loops" in order) mission.vehicles[0].closedLoops = order.closed_loops;
  if ("mismatch" in order) mission.vehicles[0].mismatch = order.mismatch;
  if ("aims" in order) mission.vehicles[0].aims = order.aims;
  if ("favoured_time" in order) mission.vehicles[0].favouredTime = order.favoured_time;
  if ("other_surface" in order) mission.vehicles[0].otherSurface = order.other_surface;
  for (const [slot, reason] of Object.entries(order.withdraw ?? {})) mission.vehicles[0].directive.withdraw(slot, reason, mission.nowS);
  if ("earlier" in order) mission.vehicles[0].earlier = order.earlier;
  for (const entry of order.log ?? []) mission.log.push({ number: mission.log.length + 1, at_s: mission.nowS, utc: "2026-11-23T10:00:00Z", by: null, vehicle: null, ...entry });
  for (const key of ["archive", "storage", "loss", "layers", "ended", "speed", "position", "truth"]) if (key in order) mission[key] = order[key];
  if ("disk" in order) {
    const [vehicle] = mission.vehicles;
    vehicle.disk = order.disk;
    if (vehicle.status) vehicle.status.disk = order.disk;
  }
  if ("faults" in order) {
    const [vehicle] = mission.vehicles;
    vehicle.faults = order.faults;
    if (vehicle.status) vehicle.status.faults = order.faults;
  }
  if (order.label_at) mission.vehicles[0].setLabel(order.label_at, mission.nowS);
  if ("placement" in order) mission.vehicles[0].placement = order.placement;
  if ("coarse" in order) mission.vehicles[0].coarse = order.coarse;
  if (order.without_image) mission.vehicles[0].withoutImage = new Set(order.without_image);
  if ("silent" in order) mission.vehicles[0].silent = order.silent;
  if (order.refuse) mission.vehicles[0].directive.refuseNext.add(order.refuse);
  if (order.principals) mission.command.principals = order.principals;
  if (order.commander) mission.command.order(order.principals.find((p) => p.name === order.commander), "order", mission.nowS);
  if ("down" in order) mock.down = order.down;
  if ("mute" in order) mock.mute = order.mute;
  if ("stream" in order) mock.stream = order.stream;
  if (order.stream === false || order.down) for (const s of mock.streams) s.destroy();
  for (let i = 0; i < (order.times ?? 1); i += 1) {
    if (order.advance) advance(mock, order.advance);
    emit(mock, "state", mission.json());
  }
  reply(res, 200, { now_s: mission.nowS });
}

async function asset(pathname, res) {
  const name = normalize(pathname === "/" ? "/index.html" : pathname);
  const type = TYPES[extname(name)];
  if (!type || name.includes("..")) return reply(res, 404, { error: "no such page" });
  try {
    return send(res, 200, type, await readFile(join(ASSETS, name)));
  } catch {
    return reply(res, 404, { error: "no such page" });
  }
}

async function body(req) {
  let text = "";
  for await (const chunk of req) text += chunk;
  try {
    return JSON.parse(text || "{}");
  } catch {
    throw Object.assign(new Error("not JSON"), { status: 400 });
  }
}

function send(res, status, type, bytes) {
  res.writeHead(status, {
    "content-type": type, "content-length": bytes.length, "cache-control": "no-cache",
    "content-security-policy": POLICY, "x-content-type-options": "nosniff",
  });
  res.end(bytes);
}

const reply = (res, status, value) => send(res, status, "application/json", Buffer.from(JSON.stringify(value)));

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const option = (name, otherwise) => {
    const at = process.argv.indexOf(`--${name}`);
    return at > 0 ? process.argv[at + 1] : otherwise;
  };
  const { url } = await startMock({ port: Number(option("port", 8470)), scenario: option("scenario", "rich"), live: true });
  console.log(url);
}
