import assert from "node:assert/strict";
import { PHONE } from "../stage.mjs";

const open = (s) => s.page.getByRole("tab", { name: "Constraints" }).click();
const state = async (s) => s.vehicle((await s.inPage(({ store }) => store.selectedId)));
const field = (s, name) => s.page.getByLabel(name, { exact: true });
const sendFence = (s) => s.page.locator("#send-fence");
const sendLimits = (s) => s.page.locator("#send-limits");
const slot = async (s, name) => (await state(s)).directive.slots.find((x) => x.slot === name);

/** Clicks places of the map given as shares of its width and height. */
async function click(s, ...places) {
  const box = await s.page.locator("#chart").boundingBox();
  for (const [x, y] of places) await s.page.mouse.click(box.x + x * box.width, box.y + y * box.height);
}

async function clear(s) {
  await open(s);
  for (const b of await s.page.getByRole("button", { name: /^Delete (Fence|Keep-out)/ }).all()) await b.click();
}

async function draw(s, tool, ...places) {
  await s.button(tool).click();
  await click(s, ...places);
  await s.button("Done drawing").click();
}

const AROUND = [[0.03, 0.06], [0.97, 0.06], [0.97, 0.94], [0.03, 0.94]];
const CROSSED = [[0.1, 0.1], [0.3, 0.3], [0.3, 0.1], [0.1, 0.3]];

/** The share of the pixels along a line of the map that have the colour `tone`: it tells solid lines from dashed ones. */
const share = (s, from, to, tone) => s.inPage(({ view, ink }, [a, b, name]) => {
  const c = document.getElementById("chart").getContext("2d");
  const wanted = ink(name);
  let hits = 0;
  for (let i = 0; i < 400; i += 1) {
    const [x, y] = view.toScreen(a[0] + ((b[0] - a[0]) * i) / 400, a[1] + ((b[1] - a[1]) * i) / 400);
    const seen = c.getImageData(Math.floor(x), Math.floor(y), 1, 1).data;
    hits += wanted.every((v, n) => Math.abs(v - seen[n]) < 12) ? 1 : 0;
  }
  return hits / 400;
}, [from, to, tone]);

export default [
  {
    name: "a fence drawn on the map is sent and its status shown",
    ends: true,
    async run(s) {
      await s.shows("#vehicle .age", /Status/, { ms: 60000, advance: 5 });
      await clear(s);
      await s.button("Fit").click();
      await draw(s, "Draw fence", ...AROUND);
      const before = (await slot(s, "fence"))?.version ?? 0;
      await sendFence(s).click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/fence")));
      assert.equal(s.posts.at(-1).body.fence.length, 4);
      await s.shows("[aria-labelledby=fence-title] .steps [aria-current]", /Applied|Refused/, { ms: 240000, advance: 2 });
      assert.ok((await slot(s, "fence")).version > before);
      assert.deepEqual((await state(s)).fence.fence, s.posts.at(-1).body.fence);
    },
  },
  {
    name: "a weighted area is drawn, weighed, sent and shown as in force; its corners and those of the fence are edited apart",
    ends: true,
    async run(s) {
      await s.shows("#vehicle .age", /Status/, { ms: 60000, advance: 5 });
      await clear(s);
      await s.button("Fit").click();
      await draw(s, "Draw area", [0.3, 0.3], [0.6, 0.3], [0.6, 0.6]);
      await field(s, "Weight of Area 1").fill("-0.4");
      await s.shows("[aria-labelledby=areas-title] output", /−0\.40/);
      await s.page.locator("#send-areas").click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/areas")));
      const sent = s.posts.at(-1).body.areas;
      assert.deepEqual([sent.length, sent[0].outline.length, sent[0].weight], [1, 3, -0.4]);
      await s.shows("[aria-labelledby=areas-title] .steps [aria-current]", /Applied/, { ms: 240000, advance: 2 });
      await s.until("the area in force", async () => (await state(s)).areas_in_force?.order.areas.length === 1, { advance: 2 });
      await draw(s, "Draw fence", ...AROUND);
      // The drag takes hold of a corner of the area; the fence stays as it was drawn.
      const box = await s.page.locator("#chart").boundingBox();
      await s.page.mouse.move(box.x + 0.6 * box.width, box.y + 0.6 * box.height);
      await s.page.mouse.down();
      await s.page.mouse.move(box.x + 0.65 * box.width, box.y + 0.7 * box.height, { steps: 4 });
      await s.page.mouse.up();
      await s.until("the edit", () => s.page.locator("#send-areas").isEnabled());
      await s.page.locator("#send-areas").click();
      await s.until("another message", () => s.posts.filter((p) => p.path.endsWith("/areas")).length === 2);
      const moved = s.posts.at(-1).body.areas[0].outline;
      assert.deepEqual(moved.slice(0, 2), sent[0].outline.slice(0, 2));
      assert.notDeepEqual(moved[2], sent[0].outline[2]);
      await s.page.getByRole("button", { name: "Delete Area 1" }).click();
      await s.page.locator("#send-areas").click();
      await s.until("no area", () => s.posts.filter((p) => p.path.endsWith("/areas")).at(-1).body.areas.length === 0);
    },
  },
  {
    name: "a fence is sent once it is closed, and says before what it would cut off",
    scenario: "rich",
    async run(s) {
      await click(s, [0.5, 0.5]);
      await s.visible("#place");
      await open(s);
      await s.button("Draw fence").click();
      await s.visible("#place", false);
      for (const at of [[0.3, 0.3], [0.7, 0.3], [0.7, 0.7], [0.3, 0.7]]) await click(s, at);
      assert.ok(await sendFence(s).isDisabled());
      assert.equal(await s.page.locator("#fence-preview").isVisible(), false);
      await s.button("Done drawing").click();
      await s.shows("#fence-preview", /^Area [\d\s]+ m\u00b2\. [\d\s]+ of [\d\s]+ explored cells lie outside .* from the nearest edge/);
      await s.shows("#fence-preview", /One pass in straight legs within it takes about 29.min 34.s, 887.m\.$/);
      assert.equal(await sendFence(s).isDisabled(), false);
      await sendFence(s).click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/fence")));
      const { fence, ...others } = s.posts.at(-1).body;
      assert.deepEqual([fence.length, others], [4, { keep_outs: [], return_point: null }]);
    },
  },
  {
    name: "a fence under way is dashed, one in force solid",
    scenario: "rich",
    async run(s) {
      const fence = [[-11, -8], [18, -8], [18, 14], [-11, 14]];
      await s.steer({ loss: 1 });
      await s.post("/vehicles/1/fence", { fence });
      await s.until("a dashed line", async () => {
        const seen = await share(s, fence[0], fence[3], "--map-fence");
        return seen > 0.4 && seen < 0.8;
      });
      await s.steer({ loss: 0, advance: 60 });
      await s.until("a solid line", async () => (await share(s, fence[0], fence[3], "--map-fence")) > 0.95);
      await s.steer({ loss: 1 });
      const other = [[-13, -8], [18, -8], [18, 14], [-13, 14]];
      await s.post("/vehicles/1/fence", { fence: other });
      await s.until("both", async () => (await share(s, other[0], other[3], "--map-fence")) > 0.4 && (await share(s, fence[0], fence[3], "--map-fence")) > 0.95);
      await open(s);
      await s.shows("[aria-labelledby=fence-title] .note", /Version 1 stays in force meanwhile/);
    },
  },
  {
    name: "a refused fence shows the reason",
    scenario: "rich",
    async run(s) {
      await open(s);
      await s.steer({ refuse: "fence", loss: 0 });
      await draw(s, "Draw fence", ...AROUND);
      await sendFence(s).click();
      await s.shows("[aria-labelledby=fence-title] .order-status", /Refused.*the vehicle is outside of it/s, { advance: 3 });
      assert.match(await sendFence(s).innerText(), /again/);
    },
  },
  {
    name: "after a refusal the fence in force can be edited",
    scenario: "rich",
    async run(s) {
      const force = [[-20, -20], [30, -20], [30, 30], [-20, 30]];
      await open(s);
      await s.steer({ loss: 0 });
      await s.post("/vehicles/1/fence", { fence: force });
      await s.shows("[aria-labelledby=fence-title] .steps [aria-current]", /Applied/, { advance: 2 });
      await s.steer({ refuse: "fence" });
      await s.post("/vehicles/1/fence", { fence: [[50, 50], [60, 50], [60, 60]] });
      await s.shows("[aria-labelledby=fence-title] .note", /Version 1 stays in force \(solid lines\)/, { advance: 2 });
      await s.button("Edit the fence in force").click();
      await sendFence(s).click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/fence")));
      assert.deepEqual(s.posts.at(-1).body.fence, force);
    },
  },
  {
    name: "an outline that crosses itself is not sent and shows its fault",
    async run(s) {
      await clear(s);
      await s.button("Add keep-out").click();
      await click(s, CROSSED[0], CROSSED[1]);
      await s.shows(".outline .error", /2 corners: an outline has 3 to 34/);
      assert.ok(await sendFence(s).isDisabled());
      await click(s, CROSSED[2], CROSSED[3]);
      await s.shows(".outline .error", /side after corner 1 crosses or touches the one after corner 3/);
      assert.ok(await sendFence(s).isDisabled());
      await s.button("Done drawing").click();
      await s.page.getByRole("button", { name: "Keep-out 1: 4 corners, as numbers" }).click();
      await s.page.getByRole("button", { name: "Delete corner 4 of Keep-out 1" }).click();
      await s.until("no fault", async () => !(await s.page.locator(".outlines .error").first().isVisible()));
      assert.equal(await sendFence(s).isDisabled(), false);
      await s.button("Discard fence edits").click();
    },
  },
  {
    name: "corners are dragged, added to a side, and deleted",
    scenario: "rich",
    async run(s) {
      await open(s);
      await draw(s, "Draw fence", ...AROUND);
      const plan = () => s.inPage(async () => {
        const { fenceOrder, planOf } = await import("/js/fence/edit.js");
        return planOf(fenceOrder).outlines[0].points;
      });
      const first = await plan();
      const box = await s.page.locator("#chart").boundingBox();
      const drag = async (from, to) => {
        await s.page.mouse.move(box.x + from[0] * box.width, box.y + from[1] * box.height);
        await s.page.mouse.down();
        await s.page.mouse.move(box.x + to[0] * box.width, box.y + to[1] * box.height, { steps: 5 });
        await s.page.mouse.up();
      };
      await drag(AROUND[0], [0.1, 0.2]);
      const moved = await plan();
      assert.ok(moved[0][0] > first[0][0] && moved[0][1] < first[0][1], `${first[0]} -> ${moved[0]}`);
      assert.deepEqual(moved.slice(1), first.slice(1));
      await drag([0.97, 0.5], [0.9, 0.5]);
      assert.equal((await plan()).length, 5);
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("Delete");
      assert.deepEqual(await plan(), moved);
    },
  },
  {
    name: "a fence is drawn, moved and sent by keys alone",
    scenario: "rich",
    async run(s) {
      await s.page.locator("#tab-vehicle").focus();
      await s.page.keyboard.press("ArrowRight");
      await s.button("Draw fence").focus();
      await s.page.keyboard.press("Enter");
      const press = async (key, times) => {
        for (let i = 0; i < times; i += 1) await s.page.keyboard.press(key);
      };
      await press("ArrowLeft", 5), await press("ArrowUp", 4), await press("Enter", 1);
      await press("ArrowRight", 10), await press("Enter", 1);
      await press("ArrowDown", 8), await press("Enter", 1);
      await press("ArrowLeft", 10), await press("Enter", 1);
      await press("Escape", 1);
      const plan = () => s.inPage(async () => {
        const { fenceOrder, planOf } = await import("/js/fence/edit.js");
        return planOf(fenceOrder).outlines[0].points;
      });
      const drawn = await plan();
      assert.equal(drawn.length, 4);
      await press("n", 1);
      await press("Shift+ArrowRight", 2);
      const moved = await plan();
      assert.ok(moved[0][0] > drawn[0][0] && moved[0][1] === drawn[0][1]);
      await sendFence(s).focus();
      await press("Enter", 1);
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/fence")));
      assert.deepEqual(s.posts.at(-1).body.fence, moved);
    },
  },
  {
    name: "on a phone a finger sets corners without panning the map",
    scenario: "rich",
    size: PHONE,
    async run(s) {
      await open(s);
      await s.button("Draw fence").click();
      const box = await s.page.locator("#chart").boundingBox();
      const before = await s.inPage(({ view }) => [view.east, view.north]);
      for (const [x, y] of [[0.1, 0.2], [0.9, 0.2], [0.5, 0.9]]) await s.page.touchscreen.tap(box.x + x * box.width, box.y + y * box.height);
      await s.button("Done drawing").click();
      assert.deepEqual(await s.inPage(({ view }) => [view.east, view.north]), before);
      await s.page.getByRole("button", { name: "Fence: 3 corners, as numbers" }).waitFor();
      assert.equal(await sendFence(s).isDisabled(), false);
    },
  },
  {
    name: "a return point outside the fence shows its fault at once",
    scenario: "rich",
    async run(s) {
      await open(s);
      await draw(s, "Draw fence", [0.3, 0.3], [0.7, 0.3], [0.7, 0.7], [0.3, 0.7]);
      await s.button("Place return point").click();
      await click(s, [0.1, 0.1]);
      await s.shows("[aria-labelledby=fence-title] > .outline .error", /outside the fence/);
      assert.ok(await sendFence(s).isDisabled());
      await s.page.getByRole("button", { name: "Remove the return point" }).click();
      assert.equal(await sendFence(s).isDisabled(), false);
    },
  },
  {
    name: "limits are checked while typed, and sent as a whole",
    ends: true,
    async run(s) {
      await s.shows("#vehicle .age", /Status/, { ms: 60000, advance: 5 });
      await open(s);
      await field(s, "Depth, m, lowest").fill("50");
      await field(s, "Depth, m, highest").fill("0.5");
      await s.shows("#depth_m-fault", /lowest must be below the highest/);
      assert.ok(await sendLimits(s).isDisabled());
      await field(s, "Depth, m, lowest").fill("0");
      await field(s, "Depth, m, highest").fill("");
      await s.shows("#depth_m-fault", /both bounds, or neither/);
      await field(s, "Depth, m, highest").fill("500");
      await field(s, "Silence, s").fill("0");
      await s.shows("#silence_s-fault", /1 to 65535, whole numbers/);
      await field(s, "Silence, s").fill("900");
      await s.page.getByLabel("On silence").selectOption("return");
      await sendLimits(s).click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/limits")));
      const kept = s.posts.at(-1).body;
      assert.deepEqual([kept.depth_m, kept.silence_s, kept.on_silence], [[0, 500], 900, "return"]);
      await s.shows("[aria-labelledby=limits-title] .steps [aria-current]", /Applied/, { ms: 240000, advance: 2 });
      assert.equal((await state(s)).limits.silence_s, 900);
    },
  },
  {
    name: "abort needs a second, deliberate yes",
    async run(s) {
      await s.page.locator("#abort").click();
      const go = s.page.locator("#dialog .primary");
      assert.ok(await go.isDisabled());
      await s.button("Cancel").click();
      assert.equal(s.posts.length, 0);
      if (!s.mocked) return;
      await s.page.locator("#abort").click();
      await s.page.getByLabel("Yes, abort").check();
      await go.click();
      await s.until("the message", () => s.posts.length > 0);
      assert.deepEqual(s.posts.at(-1).body, { action: "abort" });
      await s.shows("#vehicle .mode", /abort/, { advance: 4 });
      assert.ok(await s.page.locator("#resume").isVisible());
    },
  },
  {
    name: "an edit during a send is not taken for another console's",
    scenario: "rich",
    async run(s) {
      await open(s);
      await draw(s, "Draw fence", ...AROUND);
      let release = null;
      const drawn = new Promise((resolve) => (release = resolve));
      await s.page.route("**/fence", (route) => drawn.then(() => route.continue()));
      await sendFence(s).click();
      await draw(s, "Add keep-out", [0.4, 0.4], [0.5, 0.4], [0.5, 0.5]);
      release();
      await s.until("its version", async () => (await slot(s, "fence"))?.version === 1);
      const { now_s } = await s.get("/state");
      await s.until("states after it", () => s.inPage(({ store }, now) => store.snapshot.now_s > now + 1, now_s), { advance: 1 });
      assert.equal(await s.page.locator("[aria-labelledby=fence-title] .replaced").isVisible(), false);
      assert.equal(await s.page.locator(".outlines > li").count(), 2, "the edit is still there");
      assert.equal(await sendFence(s).isDisabled(), false);
    },
  },
  {
    name: "a fence changed by another console is a warning on a draft",
    scenario: "rich",
    async run(s) {
      await open(s);
      await draw(s, "Draw fence", ...AROUND);
      await sendFence(s).click();
      await s.until("its version", async () => (await slot(s, "fence"))?.version === 1);
      await s.post("/vehicles/1/fence", { fence: [[-30, -30], [40, -30], [40, 40]] });
      await s.shows("[aria-labelledby=fence-title] .replaced", /Changed by another console \(version 2\) after your order/);
      await s.page.getByRole("button", { name: "Fence: 3 corners, as numbers" }).waitFor();
      await draw(s, "Add keep-out", [0.1, 0.1], [0.2, 0.1], [0.2, 0.2]);
      await s.post("/vehicles/1/fence", { fence: null });
      await s.shows("[aria-labelledby=fence-title] .replaced", /meanwhile: Send replaces that change/);
      await s.button("Discard fence edits").click();
      await s.until("theirs", async () => (await s.page.locator(".outlines > li").count()) === 0);
      await s.page.getByRole("button", { name: "OK: Fence changed by another console" }).click();
      await s.until("no note", async () => !(await s.page.locator("[aria-labelledby=fence-title] .replaced").isVisible()));
    },
  },
];
