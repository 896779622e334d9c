// Takes the screenshots of the operator's page: every state, theme and size, and the ones for the README.
//
//   node shots.mjs [--out DIR] [--only TEXT]           from the mock, into out/console-shots
//   node shots.mjs --url http://127.0.0.1:8460 --out DIR   what a running daemon shows now

import { mkdir } from "node:fs/promises";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { LAUNCH } from "./browser.mjs";
import { startMock } from "./mock/server.mjs";
import { PHONE, WIDE } from "./stage.mjs";

const option = (name, otherwise) => {
  const at = process.argv.indexOf(`--${name}`);
  return at > 0 ? process.argv[at + 1] : otherwise;
};
const SIZES = { wide: WIDE, phone: PHONE };
const THEMES = ["light", "dark", "red"];
const out = option("out", new URL("../../out/console-shots", import.meta.url).pathname);
const given = option("url", null);

const tab = (name) => (page) => page.getByRole("tab", { name }).click();

/** name -> {scenario, sizes, steps}: what is done before the picture is taken. */
const SCENES = {
  empty: { scenario: "empty" },
  rich: { scenario: "rich", steps: working },
  silent: { scenario: "silent" },
  refused: { scenario: "refused" },
  lost: { scenario: "rich", steps: (page, steer) => steer({ down: true }).then(() => page.waitForTimeout(1500)) },
  vehicle: { scenario: "refused", sizes: ["phone"], steps: tab("Vehicle") },
  link: { scenario: "rich", sizes: ["phone"], steps: tab("Link") },
  two: { scenario: "two", sizes: ["wide"] },
  age: { scenario: "rich", sizes: ["wide"], steps: (page) => page.selectOption("#layer", "age") },
  cloud: { scenario: "rich", sizes: ["wide"], steps: cloud },
};

/** Weights sent and under way, one more being set, two pictures asked for, the pointer on the map. */
async function working(page, steer) {
  const weigh = (n, w) => page.getByRole("slider", { name: `Weight of Label ${n}` }).fill(w);
  const wide = page.viewportSize().width > 1100;
  await page.getByRole("button", { name: "Show me: a picture of Label 2" }).click();
  await steer({ advance: 90, loss: 0.02 });
  await page.getByRole("button", { name: "Show me: a picture of Label 4" }).click();
  await weigh(2, "0.7");
  await weigh(5, "-0.4");
  await page.locator("#send-weights").click();
  await steer({ advance: 14 });
  if (wide) await page.mouse.move(820, 380);
}

async function cloud(page, steer) {
  await steer({ planes: true, advance: 14 });
  await page.waitForTimeout(500);
  await page.getByRole("button", { name: "3-D" }).click();
}

async function shoot(browser, url, { name, size, theme, steps, steer }) {
  const context = await browser.newContext({ viewport: SIZES[size], hasTouch: size === "phone" });
  const page = await context.newPage();
  await page.addInitScript((t) => localStorage.setItem("scenecast.theme", JSON.stringify(t)), theme);
  await page.goto(url);
  await page.waitForTimeout(900);
  await steps?.(page, steer);
  await page.waitForTimeout(700);
  await page.screenshot({ path: join(out, `${name}-${theme}-${size}.png`) });
  await context.close();
}

await mkdir(out, { recursive: true });
const browser = await chromium.launch(LAUNCH);
if (given) {
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
