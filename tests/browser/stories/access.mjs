import assert from "node:assert/strict";
import { clean } from "../axe.mjs";
import { PHONE, WIDE } from "../stage.mjs";

const states = [["rich", null], ["empty", "empty"], ["silent", "silent"], ["refused", "refused"]];
const audits = ["light", "dark", "red"].flatMap((theme) =>
  states.map(([name, scenario]) => ({
    name: `axe finds no fault: ${name}, ${theme}`,
    theme, scenario, size: WIDE, again: theme !== "light",
    async run(s) {
      await s.page.locator("#vehicle .values").waitFor();
      await clean(s);
      if (name !== "rich") return;
      await s.page.locator(".label .name").first().click();
      await clean(s);
      await s.page.keyboard.press("Escape");
      await s.page.setViewportSize(PHONE);
      for (const tab of ["Labels", "Vehicle", "Constraints", "Link", "Model"]) {
        await s.page.getByRole("tab", { name: tab }).click();
        await clean(s);
      }
    },
  })));

const pointing = [WIDE, PHONE].flatMap((size) => ["light", "dark", "red"].map((theme) => ({
  name: `axe finds no fault in the plate of a marked place and the natural layer: ${theme}, ${size.width} px`,
  theme, size, again: theme !== "light",
  scenario: "rich",
  async run(s) {
    await s.page.selectOption("#layer", "natural");
    const box = await s.page.locator("#chart").boundingBox();
    const place = [box.x + 0.4 * box.width, box.y + 0.5 * box.height];
    await s.page.mouse.click(...place);
    await s.page.getByLabel("Text of the marker").fill("a wreck");
    await clean(s);
    await s.page.getByRole("button", { name: "Set marker" }).click();
    await s.until("the marker", () => s.inPage(({ store }) => store.vehicle.markers.length > 0), { advance: 1 });
    await s.page.mouse.click(...place);
    await s.shows("#place", /a wreck.*marked by|marked by.*a wreck/s);
    const remove = s.page.getByRole("button", { name: "Remove marker" });
    await remove.focus();
    await s.steer({ advance: 3 });
    await s.until("a later age", async () => /marked by .* [2-9].s ago/s.test(await s.page.locator("#place").innerText()), { advance: 1 });
    assert.ok(await remove.evaluate((button) => button === document.activeElement), "the button keeps the focus");
    await clean(s);
  },
})));

const logs = ["light", "dark", "red"].map((theme) => ({
  name: `axe finds no fault in the log: ${theme}`,
  theme, again: theme !== "light",
  scenario: "start",
  async run(s) {
    await s.page.getByRole("tab", { name: "Log" }).click();
    await s.steer({ log: [{ kind: "order", by: "ann", vehicle: 1, text: "weights: label 3 +0.80" }] });
    await s.shows("#log .log", /weights: label 3/, { advance: 1 });
    await clean(s);
  },
}));

const editing = ["light", "dark", "red"].map((theme) => ({
  name: `axe finds no fault in a fence edit and an abort: ${theme}`,
  theme, again: theme !== "light",
  scenario: "rich",
  async run(s) {
    await s.page.getByRole("tab", { name: "Constraints" }).click();
    await s.button("Draw fence").click();
    const box = await s.page.locator("#chart").boundingBox();
    for (const [x, y] of [[0.2, 0.2], [0.8, 0.8], [0.8, 0.2], [0.2, 0.8]]) await s.page.mouse.click(box.x + x * box.width, box.y + y * box.height);
    await s.page.getByRole("button", { name: "Fence: 4 corners, as numbers" }).click();
    await s.page.getByLabel("Depth, m, lowest").fill("50");
    await clean(s);
    await s.page.getByRole("tab", { name: "Vehicle" }).click();
    await s.page.locator("#abort").click();
    await clean(s);
  },
}));

/** The ids of the first five elements that the Tab key reaches. */
async function firstStops(s) {
  const stops = [];
  for (let i = 0; i < 5; i += 1) {
    await s.page.keyboard.press("Tab");
    stops.push(await s.page.evaluate(() => document.activeElement.id || document.activeElement.textContent));
  }
  return stops;
}

const stopping = [WIDE, PHONE].map((size) => ({
  name: `hold and abort are among the first five stops of the Tab key: ${size.width} px`,
  size, scenario: "rich",
  async run(s) {
    await s.page.locator("#bar-hold:enabled").waitFor();
    const stops = await firstStops(s);
    assert.ok(stops.includes("bar-hold") && stops.includes("bar-abort"), stops.join(", "));
    await s.page.keyboard.press("Shift+A");
    await s.shows("#dialog", /Abort the mission of/);
    await s.page.keyboard.press("Escape");
    await s.page.keyboard.press("Shift+H");
    await s.shows("#dialog", /^Hold/);
    await s.page.keyboard.press("Escape");
    assert.equal(await s.page.getByRole("heading", { level: 1 }).count(), 1);
    assert.equal(s.posts.length, 0, "nothing was sent");
  },
}));

export default [
  ...audits,
  ...logs, ...editing,
  ...pointing,
  ...stopping,
  {
    name: "the keys of hold and abort do nothing while a text is typed",
    scenario: "rich",
    async run(s) {
      await s.page.locator("#budget").focus();
      for (const key of ["Shift+H", "Shift+A"]) await s.page.keyboard.press(key);
      assert.ok(!(await s.page.locator("#dialog").evaluate((d) => d.open)));
    },
  },
  {
    name: "weights can be set and sent with the keyboard alone",
    async run(s) {
      await s.page.locator(".label").first().waitFor();
      const onto = async (match) => {
        for (let i = 0; i < 80; i += 1) {
          await s.page.keyboard.press("Tab");
          if (await s.page.evaluate((m) => document.activeElement.matches(m), match)) return;
        }
        throw new Error(`Tab never reached ${match}`);
      };
      await onto(".label input[type=range]");
      await s.page.keyboard.press("ArrowRight");
      await onto("#send-weights");
      await s.page.keyboard.press("Enter");
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/utility")));
    },
  },
  {
    name: "on a phone all fits the screen and the tabs change panels",
    size: PHONE,
    async run(s) {
      const over = await s.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      assert.ok(over <= 0, `${over} px too wide`);
      await s.page.getByRole("tab", { name: "Link" }).click();
      assert.ok(await s.page.locator("#link").isVisible());
      assert.equal(await s.page.locator("#labels").isVisible(), false);
    },
  },
  {
    name: "the theme is remembered",
    async run(s) {
      const theme = () => s.page.evaluate(() => document.documentElement.dataset.theme);
      await s.page.locator("#theme").click();
      assert.equal(await theme(), "dark");
      await s.page.reload();
      assert.equal(await theme(), "dark");
    },
  },
  {
    name: "the page uses no other host and no inline script or style",
    bare: true,
    async run(s) {
      const hosts = new Set();
      s.page.on("request", (r) => hosts.add(new URL(r.url()).origin));
      await s.page.reload();
      await s.ready();
      assert.deepEqual([...hosts], [new URL(s.url).origin]);
      const html = await (await fetch(s.url)).text();
      const loaded = await s.page.evaluate(() => performance.getEntriesByType("resource").map((r) => new URL(r.name).pathname).filter((p) => p.endsWith(".js")));
      const named = [...html.matchAll(/(?:href|src)="(js[^"]+)"/g)].map((m) => `/${m[1]}`);
      assert.deepEqual([...new Set(loaded)].sort(), named.sort(), "each module is named in the page, so that none waits for another");
      assert.doesNotMatch(html, /\sstyle=|<style|\son\w+=|<script(?![^>]*\ssrc=)/);
    },
  },
];
