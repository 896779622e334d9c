// The page of a record. The mock plays a record only as far as a story advances it.

import assert from "node:assert/strict";
import { clean } from "../axe.mjs";
import { FROM_UTC_S } from "../mock/replay.mjs";
import { PHONE, WIDE } from "../stage.mjs";
import { countTones } from "./vehicle.mjs";

const LAPTOP = { width: 1280, height: 800 };
const REASON = "This is a record: it takes no orders.";

/** Seconds of the record at the server. */
const atS = async (s) => (await s.get("/state")).replay.at_utc_s - FROM_UTC_S;
const isAt = (s, seconds) => s.until(`the moment ${seconds} s`, async () => Math.abs((await atS(s)) - seconds) < 0.5);
/** What this page asked the server for. */
const changes = (s) => s.posts.filter((p) => p.path === "/api/v2/replay").map((p) => p.body);
const shownMoment = (s, pattern) => s.shows("#replay .moment", pattern);
const marks = (s) => s.until("the marks", () => s.page.locator("#replay .marks .mark").count());

/** Drags the thumb to these shares of the slider. */
async function drag(s, shares) {
  const box = await s.page.locator("#replay-at").boundingBox();
  const to = (share) => [box.x + 8 + share * (box.width - 16), box.y + box.height / 2];
  await s.page.mouse.move(...to(shares[0]));
  await s.page.mouse.down();
  for (const share of shares.slice(1)) await s.page.mouse.move(...to(share));
}

const audits = ["light", "dark", "red"].flatMap((theme) => [LAPTOP, PHONE].map((size) => ({
  name: `axe finds no fault in a record, and all of its bar is in view: ${theme}, ${size.width} px`,
  theme, size, again: theme !== "light",
  scenario: "replay",
  async run(s) {
    await marks(s);
    await clean(s);
    const outside = await s.page.evaluate(() => {
      const bar = document.getElementById("replay");
      const parts = [...bar.querySelectorAll("button, select, input, .moment")].filter((e) => e.checkVisibility()).map((e) => [e, e.getBoundingClientRect()]);
      const over = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
      const hidden = parts.filter(([, r]) => r.left < 0 || r.right > innerWidth || r.bottom > innerHeight);
      const covered = parts.filter(([, r], i) => parts.some(([, other], k) => i !== k && over(r, other)));
      const narrow = document.getElementById("stage").clientHeight < 200 || document.documentElement.scrollWidth > innerWidth;
      return [...hidden, ...covered].map(([e]) => e.id || e.className || e.textContent).concat(narrow ? ["the map"] : []);
    });
    assert.deepEqual(outside, []);
    await s.button("Difference: 30 cells").click();
    await s.shows("#map-age", /Differing cells/);
    await s.page.getByRole("tab", { name: "Constraints" }).click();
    await clean(s);
  },
})));

export default [
  ...audits,
  {
    name: "a live surface has no time line and nothing that says record",
    scenario: "rich",
    async run(s) {
      assert.ok(!(await s.page.locator("#replay").isVisible()));
      assert.ok(await s.page.locator("#command").isVisible());
      assert.equal(await s.page.getByText(/Record of/).count(), 0);
      await s.shows("#feed", /^Live$/);
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("Space");
      assert.deepEqual(s.posts, []);
    },
  },
  {
    name: "a record says that nothing is live, and shows its moment in UTC and its marks",
    scenario: "replay", size: WIDE,
    async run(s) {
      await s.shows("#banners", /Record of 2026-11-29 10:15 UTC: nothing here is live/);
      await s.shows("#feed", /^Record$/);
      await shownMoment(s, /^2026-11-29 10:18:20 UTC$/);
      await s.shows("#replay .replay-time", /0:03:20 of 0:05:30/);
      for (const id of ["#command", "#sound"]) assert.ok(!(await s.page.locator(id).isVisible()), id);
      assert.equal(await marks(s), 10);
      const kinds = await s.page.locator("#replay .marks .mark").evaluateAll((all) => all.map((m) => m.dataset.kind));
      assert.deepEqual(new Set(kinds), new Set(["label", "order", "other", "silence", "loop", "fault"]));
      const silence = s.page.locator("#replay .marks .mark[data-kind=silence]");
      assert.equal(await silence.getAttribute("title"), "2026-11-29 10:17:00 UTC: auv-1: silent for 2 min 5 s");
      await s.button("Keys").click();
      await s.shows("#dialog", /play or pause/);
    },
  },
  {
    name: "events of one pixel column share a mark",
    scenario: "replay",
    async run(s) {
      const further = Array.from({ length: 3000 }, (_, i) => ({ at_utc_s: FROM_UTC_S + i / 10, kind: i === 1500 ? "fault" : "mode", vehicle: null, text: `mode ${i}` }));
      await s.steer({ replay: { further } });
      await s.page.reload();
      await s.ready();
      const count = await marks(s);
      const width = await s.page.locator("#replay .marks").evaluate((e) => e.clientWidth);
      assert.ok(count > 100 && count <= width, `${count} marks on ${width} px`);
      const sum = await s.page.locator("#replay .marks .mark").evaluateAll((all) => all.reduce((n, m) => n + Number(m.dataset.events), 0));
      assert.equal(sum, 3010);
      assert.equal(await s.page.locator("#replay .marks .mark[data-kind=fault]").count(), 2);
    },
  },
  {
    name: "a record is played, paused and played faster, by buttons and by keys",
    scenario: "replay",
    async run(s) {
      await s.button("Play").click();
      await s.button("Pause").waitFor();
      await s.until("the change", () => changes(s).length === 1);
      assert.deepEqual(changes(s), [{ is_playing: true }]);
      await s.steer({ advance: 20 });
      await shownMoment(s, /10:18:40 UTC/);
      await s.shows("#clock", /T\+0:03:40/);
      await s.page.locator("#replay-speed").selectOption("60");
      await s.until("the speed", async () => (await s.get("/state")).replay.speed === 60);
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("Space");
      await s.until("the pause", async () => !(await s.get("/state")).replay.is_playing);
      await s.page.locator("#chart").blur();
      await s.page.keyboard.press("ArrowLeft");
      await isAt(s, 210);
      await s.page.keyboard.press("ArrowRight");
      await s.page.keyboard.press("ArrowRight");
      await isAt(s, 230);
      await s.page.keyboard.press("Shift+ArrowRight");
      await isAt(s, 240);
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("ArrowLeft");
      await s.page.locator("#replay-speed").focus();
      await s.page.keyboard.press("ArrowDown");
      await isAt(s, 240);
      await s.page.locator("#replay-at").focus();
      await s.page.keyboard.press("ArrowLeft");
      await isAt(s, 230);
    },
  },
  {
    name: "buttons jump to the next event and to the one before, of the chosen kind",
    scenario: "replay",
    async run(s) {
      await marks(s);
      await s.shows("#replay .replay-event", /10:18:00 UTC: auv-1: label 4 is on the map/);
      await s.button("Next event").click();
      await shownMoment(s, /10:18:35 UTC/);
      await isAt(s, 215);
      await s.shows("#replay .replay-event", /camera: no frames/);
      await s.button("Next event").click();
      await isAt(s, 240);
      await s.button("Previous event").click();
      await isAt(s, 215);
      await s.button("Previous event").click();
      await isAt(s, 180);
      await s.page.locator("#replay-filter").selectOption("silence");
      await s.button("Previous event").click();
      await isAt(s, 120);
      assert.equal(await s.button("Previous event").getAttribute("aria-disabled"), "true");
      await s.page.locator("#replay-filter").selectOption("order");
      await s.button("Next event").click();
      await isAt(s, 300);
      await s.page.locator("#replay .marks .mark[data-kind=loop]").click();
      await isAt(s, 150);
    },
  },
  {
    name: "a dragged slider shows its moment at once and asks for five moments a second at most, and for the last one",
    scenario: "replay",
    async run(s) {
      await s.page.setViewportSize(LAPTOP);
      await marks(s);
      const start = performance.now();
      await drag(s, Array.from({ length: 41 }, (_, i) => 0.6 - i / 100));
      await shownMoment(s, /10:16:0\d UTC/);
      await s.steer({ times: 3 });
      await shownMoment(s, /10:16:0\d UTC/);
      await s.page.mouse.up();
      await isAt(s, 66);
      await s.until("the last request", () => Math.abs(changes(s).at(-1).at_utc_s - FROM_UTC_S - 66) < 1);
      const seconds = (performance.now() - start) / 1000;
      assert.ok(changes(s).length <= 2 + 5 * seconds, `${changes(s).length} in ${seconds} s`);
    },
  },
  {
    name: "while a record is played, the slider stays under the finger and the record goes on from where it is left",
    scenario: "replay",
    async run(s) {
      await s.button("Play").click();
      await s.button("Pause").waitFor();
      await drag(s, [0.61, 0.4, 0.2]);
      await isAt(s, 66);
      await s.steer({ advance: 100 });
      await isAt(s, 166);
      await s.until("the state", () => s.inPage(({ store }) => store.nowS > 160));
      await shownMoment(s, /10:16:0\d UTC/);
      await s.page.mouse.up();
      await isAt(s, 66);
    },
  },
  {
    name: "the map shows what the operator knew, what the vehicle knew, or the difference, with the number of cells",
    scenario: "replay",
    async run(s) {
      const cells = () => s.inPage(({ store }) => [...store.map.cells()].length);
      const known = (await s.vehicle(1)).map.explored_cells;
      const { differing_cells: [{ cells: differing }] } = (await s.get("/state")).replay;
      assert.ok(differing > 0);
      await s.until("the operator's map", async () => (await cells()) === known);
      await s.shows("#map-age", /^Operator's map/);
      await s.button(`Difference: ${differing} cells`).click();
      await s.until("the difference", async () => (await cells()) === differing);
      await s.shows("#replay", /Only the cells in which the two maps differ/);
      await s.button("Vehicle knew").click();
      await s.until("the vehicle's map", async () => (await cells()) === known + differing);
      await s.shows("#map-age", /^Vehicle's map/);
      assert.deepEqual(changes(s), [{ side: "difference" }, { side: "vehicle" }]);
      await s.steer({ contact: { received_s_ago: 150, due_s_ago: 140 } });
      await s.until("the age", () => s.inPage(({ store }) => store.nowS - store.vehicle.last_received_s > 140));
      assert.ok(!(await s.page.locator("#banners").innerText()).includes("silent"), "a vehicle is not silent to itself");
      await s.button("Operator knew").click();
      await s.shows("#banners", /auv-1 is silent/);
      await s.button("Vehicle knew").click();
      await s.steer({ replay: { sides: ["vehicle"] } });
      await s.visible("#replay .sides", false);
    },
  },
  {
    name: "a small step back brings the earlier map, also while nothing is played",
    scenario: "replay",
    async run(s) {
      const seen = () => s.inPage(({ store }) => [store.map.version, store.vehicle.map.version, [...store.map.cells()].length, store.vehicle.map.explored_cells]);
      const isCurrent = async () => {
        const [have, latest, cells, explored] = await seen();
        return have === latest && cells === explored && cells;
      };
      const before = await s.until("the map", isCurrent);
      await s.post("/replay", { at_utc_s: FROM_UTC_S + 196 });
      await isAt(s, 196);
      const after = await s.until("the earlier map", async () => (await s.inPage(({ store }) => store.nowS)) === 196 && (await isCurrent()));
      assert.ok(after < before, `${after} < ${before}`);
      for (const at of [150, 100, 120, 50]) await s.post("/replay", { at_utc_s: FROM_UTC_S + at });
      const first = await s.until("the map of the first legs", async () => (await s.inPage(({ store }) => store.nowS)) === 50 && (await isCurrent()));
      assert.ok(first < after, `${first} < ${after}`);
    },
  },
  {
    name: "the log ends at the moment: later entries vanish and come again",
    scenario: "replay",
    async run(s) {
      const rows = () => s.page.locator("#log .log li").allInnerTexts();
      await s.page.getByRole("tab", { name: "Log" }).click();
      await s.until("the entries", async () => (await rows()).length === 5);
      await s.post("/replay", { at_utc_s: FROM_UTC_S + 50 });
      await s.until("fewer entries", async () => (await rows()).length === 2);
      assert.match((await rows())[0], /weights: label 3/);
      await s.post("/replay", { at_utc_s: FROM_UTC_S + 10 });
      await s.until("no entries", async () => (await rows()).length === 0);
      await s.post("/replay", { at_utc_s: FROM_UTC_S + 329 });
      await s.until("all entries", async () => (await rows()).length === 8);
      assert.match((await rows())[0], /fence: 4 corners/);
    },
  },
  {
    name: "an alarm of a record is shown, without a sound and without a button",
    scenario: "replay",
    async run(s) {
      await s.page.evaluate(() => localStorage.setItem("scenecast.sound", "true"));
      await s.page.reload();
      await s.ready();
      await countTones(s);
      const other_surface = { name: "ship", holds: true, heard_s: 190, is_silent: true, is_taken_over: false };
      await s.steer({ faults: [{ text: "camera silent", is_grave: true }], other_surface });
      await s.shows("#banners", /The surface ship holds auv-1/);
      await s.shows("#banners", /auv-1: camera silent/);
      assert.equal(await s.page.locator("#banners button").count(), 0);
      assert.equal(await s.page.evaluate(() => window.tones), 0);
    },
  },
  {
    name: "a record takes no orders: their controls are disabled with the reason",
    scenario: "replay",
    async run(s) {
      const isLocked = async (selector) => {
        const control = s.page.locator(selector).first();
        await s.until(`${selector} disabled`, () => control.isDisabled());
        return control.getAttribute("title");
      };
      for (const selector of ["#bar-hold", "#bar-abort", ".exemplar .request", ".label .weight input", "#exploration", "#planner"]) {
        assert.equal(await isLocked(selector), REASON, selector);
      }
      await isLocked("#send-weights");
      await s.shows("#send .denied", /record: it takes no orders/);
      await s.page.getByRole("tab", { name: "Constraints" }).click();
      for (const selector of ["#constraints >> text=Draw fence", "#constraints input", "#send-fence"]) await isLocked(selector);
      await s.shows("#constraints .denied", /record: it takes no orders/);
      await s.page.getByRole("tab", { name: "Model" }).click();
      for (const selector of ["#set-gamma", "#set-cells", "#fit", "#send-settings"]) await isLocked(selector);
      await s.page.locator(".label .name").first().click();
      await isLocked("#dialog button.primary");
      await s.button("Cancel").click();
      await s.page.keyboard.press("Shift+A");
      assert.ok(!(await s.page.locator("#dialog").evaluate((d) => d.open)), "no dialog of an order");
      assert.equal((await s.post("/vehicles/1/constraints", { action: "hold" })).status, 403);
      assert.deepEqual(s.posts, [], "the page sends nothing");
    },
  },
];
