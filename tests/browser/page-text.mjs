// What the operator's page shows, as text: the panels of a running daemon, each a list of lines.
//
//   node page-text.mjs --url http://HOST:PORT
//
// Ages, clock times, and figures that count from the start of the program (the link's statistics and the gains of labels) are left
// out, so that the page before and after a restart of the surface can be compared.

import { chromium } from "playwright-core";
import { LAUNCH } from "./browser.mjs";
import { WIDE } from "./stage.mjs";

const TABS = ["vehicle", "constraints", "model", "log"];
/** What counts from the start of the program: gains of labels, and whether the vehicle has reported since then. */
const OF_THIS_RUN = /^[+−][\d.]+ m²$|^In force|^The vehicle (has not reported|reports)/;

const url = process.argv[process.argv.indexOf("--url") + 1];
const browser = await chromium.launch(LAUNCH);
const page = await browser.newPage({ viewport: WIDE });
await page.goto(url);
await page.locator("#label-list .label").first().waitFor();

/** The lines of a panel. The next contact is what the present run expects, so its value is left out. */
function lines(text) {
  const all = text.split("\n").map(lasting).filter((line) => line && !OF_THIS_RUN.test(line));
  return all.filter((_, i) => all[i - 1] !== "Next contact");
}

/** A line without its times and durations. */
function lasting(line) {
  return line
    .replace(/[\u00a0\u202f]/g, " ")
    .replace(/\d+:\d\d(:\d\d)?/g, "TIME")
    .replace(/(\d+(\.\d+)? (h|min|s)\b ?)+/g, "AGE ")
    .trim();
}

const shown = { labels: lines(await page.locator("#labels").innerText()) };
for (const tab of TABS) {
  await page.locator(`#tab-${tab}`).click();
  if (tab === "log") await page.locator("#log li").first().waitFor();
  shown[tab] = lines(await page.locator(`#${tab}`).innerText());
}
console.log(JSON.stringify(shown, null, 1));
await browser.close();
