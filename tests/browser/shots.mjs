// Takes the screenshots of the operator's page: every state, theme and size, and the ones for the README.
//
//   node shots.mjs [--out DIR] [--only TEXT]           from the mock, into out/console-shots
//   node shots.mjs --url http://127.0.0.1:8460 --out DIR   from a running daemon
//   ... --operate                                          after sending it weights, requests of images and a fence
//
// docs/page.png is daemon-light-wide.png of `scenecast demo --speed 6` after ten minutes of mission, with --operate.

import { mkdir } from "node:fs/promises";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { LAUNCH } from "./browser.mjs";
import { startMock } from "./mock/server.mjs";
import { MIDDLE, PHONE, WIDE } from "./stage.mjs";

const option = (name, otherwise) => {
  const at = process.argv.indexOf(`--${name}`);
  return at > 0 ? process.argv[at + 1] : otherwise;
};
const SIZES = { wide: WIDE, middle: MIDDLE, phone: PHONE };
const THEMES = ["light", "dark", "red"];
const out = option("out", new URL("../../out/console-shots", import.meta.url).pathname);
const given = option("url", null);

const tab = (name) => (page) => page.getByRole("tab", { name }).click();

/** name -> {scenario, sizes, steps}: `steps` prepare the page. */
const SCENES = {
  empty: { scenario: "empty" },
  rich: { scenario: "rich", steps: working },
  silent: { scenario: "silent" },
  refused: { scenario: "refused" },
  lost: { scenario: "rich", steps: (page, steer) => steer({ down: true }).then(() => page.locator("body[data-feed=lost]").waitFor()) },
  vehicle: { scenario: "refused", sizes: ["phone"], steps: tab("Vehicle") },
  link: { scenario: "rich", sizes: ["phone"], steps: tab("Link") },
  constraints: { scenario: "rich", steps: constrained },
  model: { scenario: "rich", steps: tuned },
  coarse: { scenario: "empty", steps: (page, steer) => steer({ coarse: true, loss: 0, advance: 100 }).then(() => page.locator("#legend").waitFor()) },
  two: { scenario: "two", sizes: ["wide"] },
  age: { scenario: "rich", sizes: ["wide"], steps: (page) => page.selectOption("#layer", "age") },
  curiosity: { scenario: "rich", sizes: ["wide"], steps: curious },
  cloud: { scenario: "rich", sizes: ["wide"], steps: cloud },
  replay: { scenario: "replay", steps: (page) => page.locator("#replay .mark").first().waitFor() },
};

/** Weights in force and on the way, a further draft, two requested images, the pointer on the map. */
async function working(page, steer) {
  const weigh = (n, w) => page.getByRole("slider", { name: `Weight of Label ${n}` }).fill(w);
  const wide = page.viewportSize().width > 1100;
  await page.getByRole("button", { name: "Request: an image of Label 2" }).click();
  await steer({ advance: 90, loss: 0.02 });
  await page.getByRole("button", { name: "Request: an image of Label 4" }).click();
  await weigh(2, "0.7");
  await weigh(5, "-0.4");
  await page.locator("#send-weights").click();
  await steer({ advance: 14 });
  if (wide) await page.mouse.move(820, 380);
}

/** A fence in force, a faulty draft of a keep-out, a faulty band. */
async function constrained(page, steer) {
  const [x, y] = [[0.03, 0.97], [0.1, 0.9]];
  const draw = async (tool, places) => {
    await page.getByRole("button", { name: tool }).click();
    const box = await page.locator("#chart").boundingBox();
    for (const [px, py] of places) await page.mouse.click(box.x + px * box.width, box.y + py * box.height);
    await page.getByRole("button", { name: "Done drawing" }).click();
  };
  await page.getByRole("tab", { name: "Constraints" }).click();
  await draw("Draw fence", [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]]);
  await draw("Add keep-out", [[0.5, 0.3], [0.62, 0.34], [0.56, 0.5]]);
  await page.locator("#send-fence").click();
  await steer({ advance: 50, loss: 0 });
  await draw("Add keep-out", [[0.2, 0.3], [0.3, 0.5], [0.3, 0.3], [0.2, 0.5]]);
  await page.getByLabel("Depth, m, lowest").fill("50");
  await page.getByLabel("Depth, m, highest").fill("5");
}

/** Settings in force, a faulty one, and a fit to a budget. */
async function tuned(page, steer) {
  await page.getByRole("tab", { name: "Model" }).click();
  await page.locator("#set-gamma").fill("1e-5");
  await page.locator("#set-layers").selectOption("depth");
  await page.locator("#send-settings").click();
  await steer({ advance: 40, loss: 0 });
  await page.locator("#fit-bps").fill("1000");
  await page.locator("#fit").click();
  await page.locator("#set-beta").fill("5000");
}

/** Advances the mission until the map has a layer. */
async function arrive(page, steer, name) {
  const layer = page.locator(`#layer option[value=${name}]`);
  for (let i = 0; i < 20 && (await layer.count()) === 0; i += 1) await steer({ advance: 14 });
  await layer.waitFor({ state: "attached" });
}

/** A layer that the operator requested, and the level under the pointer. */
async function curious(page, steer) {
  await steer({ layers: true, advance: 14 });
  await page.getByRole("checkbox", { name: "curiosity" }).check();
  await arrive(page, steer, "curiosity");
  await page.selectOption("#layer", "curiosity");
  await page.mouse.move(820, 380);
}

async function cloud(page, steer) {
  await steer({ layers: true, advance: 14 });
  await arrive(page, steer, "depth");
  await page.getByRole("button", { name: "3-D" }).click();
}

/** Gives the first vehicle of a demo the orders of an operator, and waits until the images have arrived. */
async function operate(url) {
  const post = (path, body) => fetch(`${url}/api/v2${path}`, { method: "POST", headers: { "content-type": "application/json", "x-scenecast": "1", "x-scenecast-client": "shots" }, body: JSON.stringify(body) });
  const first = async () => (await (await fetch(`${url}/api/v2/state`)).json()).vehicles[0];
  const v = await first();
  const m = v.map;
  const [west, south, east, north] = [m.x0, m.y0, m.x0 + m.width, m.y0 + m.height].map((cells, i) => cells * m.cell_m + (i < 2 ? -2 : 2));
  const x = v.status.x_m > (west + east) / 2 ? west + 5 : east - 9;
  const keepOut = [[x, north - 6], [x + 4, north - 7], [x + 2, north - 10]];
  await post(`/vehicles/${v.id}/fence`, { fence: [[west, south], [east, south], [east, north], [west, north]], keep_outs: [keepOut], return_point: [west + 2, south + 1] });
  await post(`/vehicles/${v.id}/utility`, { weights: { 3: 0.8, 5: -0.3 }, exploration: 0.2, curiosity: 0.1 });
  for (const { id: label } of v.labels.slice(0, 3)) {
    await post(`/vehicles/${v.id}/exemplars`, { label });
    const received = async () => (await first()).labels.find((l) => l.id === label).exemplar.state === "received";
    for (let i = 0; i < 60 && !(await received()); i += 1) await new Promise((resolve) => setTimeout(resolve, 500));
  }
}

/** Resolves after all images have loaded and two frames were painted. */
const settled = (page) => page.evaluate(async () => {
  await Promise.all([...document.images].filter((i) => !i.complete).map((i) => new Promise((done) => (i.onload = i.onerror = done))));
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
});

async function shoot(browser, url, { name, size, theme, steps, steer }) {
  const context = await browser.newContext({ viewport: SIZES[size], hasTouch: size === "phone" });
  const page = await context.newPage();
  await page.addInitScript((t) => {
    localStorage.setItem("scenecast.theme", JSON.stringify(t));
    localStorage.setItem("scenecast.client", '"shots"');
  }, theme);
  await page.goto(url);
  await page.locator("body[data-feed=open]").waitFor();
  await page.waitForFunction(() => import("/js/store.js").then(({ store }) => !store.vehicle || store.maps.has(store.selectedId)));
  await steps?.(page, steer);
  await settled(page);
  await page.screenshot({ path: join(out, `${name}-${theme}-${size}.png`) });
  await context.close();
}

await mkdir(out, { recursive: true });
const browser = await chromium.launch(LAUNCH);
if (given) {
  if (process.argv.includes("--operate")) await operate(given);
  for (const theme of THEMES) for (const size of Object.keys(SIZES)) await shoot(browser, given, { name: "daemon", size, theme });
} else {
  const mock = await startMock();
  const steer = (order) => fetch(`${mock.url}/mock`, { method: "POST", body: JSON.stringify(order) });
  for (const [name, scene] of Object.entries(SCENES)) {
    if (option("only", null) && !name.includes(option("only"))) continue;
    for (const theme of THEMES)
      for (const size of scene.sizes ?? Object.keys(SIZES)) {
        await steer({ scenario: scene.scenario, down: false, stream: true });
        await shoot(browser, mock.url, { name, size, theme, steps: scene.steps, steer });
      }
  }
  await mock.close();
}
await browser.close();
