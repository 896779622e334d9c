// A newcomer on the operator's page of a demo, who reads nothing but the page: he follows the card of the first mission.
//
//   scenecast demo --speed 4, then: node newcomer.mjs --url http://127.0.0.1:8460 [--theme dark] [--phone] [--out DIR]
//
// Each step is done once the card says so; after the weight, the vehicle reports that it looks for the label. A screenshot of each
// step goes to DIR (out/newcomer). Prints the mission time of each step. Exit code 1 if the weighed label is not in force, or the vehicle is not on its way to it, within five minutes of
// mission time after the page was opened.

import assert from "node:assert/strict";
import { mkdir } from "node:fs/promises";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { LAUNCH } from "./browser.mjs";
import { PHONE, WIDE } from "./stage.mjs";

const LIMIT_S = 300;
const WAIT_MS = 300_000;

const option = (name, otherwise) => {
  const at = process.argv.indexOf(`--${name}`);
  return at > 0 ? process.argv[at + 1] : otherwise;
};
const theme = option("theme", "light");
const isPhone = process.argv.includes("--phone");
const out = option("out", new URL("../../out/newcomer", import.meta.url).pathname);

/** Actions by the words of the card's steps. */
const ACTIONS = {
  async Look() {},
  async Name(page) {
    await page.locator(".label .name").first().click();
    await page.getByLabel("Name").fill("sand");
    await page.getByRole("button", { name: "Save" }).click();
  },
  async Weigh(page) {
    await page.getByRole("slider", { name: "Weight of sand" }).fill("0.8");
    await page.locator("#send").getByRole("button", { name: /^Send/ }).click();
  },
  async Steer() {},
  async Picture(page, words) {
    if (/press Request/i.test(words)) return page.getByRole("button", { name: /^Request/ }).first().click();
    await page.getByRole("button", { name: /^Image of/ }).first().click();
    await page.getByRole("button", { name: "Another" }).click();
    await page.getByRole("button", { name: "Close", exact: true }).click();
  },
};

const missionSeconds = (page) => page.evaluate(() => import("./js/store.js").then(({ store }) => store.snapshot.now_s));
const instruction = (page) => page.locator(".first-mission li[data-state=next]");

async function main() {
  await mkdir(out, { recursive: true });
  const browser = await chromium.launch(LAUNCH);
  const context = await browser.newContext({ viewport: isPhone ? PHONE : WIDE, hasTouch: isPhone });
  await context.addInitScript((t) => localStorage.setItem("scenecast.theme", JSON.stringify(t)), theme);
  const page = await context.newPage();
  page.setDefaultTimeout(WAIT_MS);
  await page.goto(option("url", "http://127.0.0.1:8460"));
  const card = page.locator(".first-mission");
  if (isPhone) await page.getByRole("tab", { name: "Labels" }).click();
  await card.waitFor();
  if (isPhone) await card.locator("summary").click();
  const began = await missionSeconds(page);
  let steered = Infinity;
  const shot = (name) => page.screenshot({ path: join(out, `${theme}-${isPhone ? "phone" : "wide"}-${name}.png`) });
  for (let step = 1; step <= 5 && (await instruction(page).count()) > 0; step += 1) {
    const line = instruction(page);
    const name = await line.locator("b").innerText();
    await shot(`${step}-${name.toLowerCase()}`);
    await ACTIONS[name](page, await line.innerText());
    await page.locator(`.first-mission li[data-state=done]:has(b:text-is("${name}"))`).waitFor();
    const passed = (await missionSeconds(page)) - began;
    console.log(`${name}: done after ${Math.round(passed)} s of mission time`);
    // The card passes over a step that is done before it is reached, as Steer may be by the first report.
    if (name === "Weigh") {
      await page.getByText("looking for sand").first().waitFor({ state: "attached" });
      steered = (await missionSeconds(page)) - began;
      console.log(`the vehicle is looking for sand after ${Math.round(steered)} s`);
    }
  }
  await shot("6-end");
  await browser.close();
  assert.ok(steered <= LIMIT_S, `steered after ${steered} s of mission time; the limit is ${LIMIT_S} s`);
}

await main();
