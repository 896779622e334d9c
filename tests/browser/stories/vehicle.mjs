import assert from "node:assert/strict";

/** Counts the tones that the page plays from now on, as `tones` of its window. */
export const countTones = (s) =>
  s.page.evaluate(() => {
    window.tones = 0;
    const part = () => ({ connect: (to) => to, start: () => (window.tones += 1), stop() {}, frequency: {}, gain: { setValueAtTime() {}, exponentialRampToValueAtTime() {} } });
    window.AudioContext = class {
      currentTime = 0;
      resume() {}
      createOscillator = part;
      createGain = part;
    };
  });

export default [
  {
    name: "a new alarm sounds once where the operator has switched the sound on",
    long: true,
    scenario: "rich",
    async run(s) {
      await countTones(s);
      const tones = () => s.page.evaluate(() => window.tones);
      const silence = async (silent) => {
        await s.steer({ silent, advance: 60 });
        await s.until(silent ? "a silent vehicle" : "no silence", async () => (await s.page.locator(".banner", { hasText: "is silent" }).isVisible()) === silent, { advance: 2 });
      };
      await silence(true);
      assert.equal(await tones(), 0, "it is off at first");
      await silence(false);
      await s.page.locator("#sound").click();
      assert.equal(await s.page.locator("#sound").getAttribute("aria-pressed"), "true");
      const played = await tones();
      assert.ok(played > 0, "the press plays the sound");
      await silence(true);
      assert.equal(await tones(), 2 * played);
      await s.page.reload();
      await s.ready();
      assert.equal(await s.page.locator("#sound").getAttribute("aria-pressed"), "true", "it stays on after a reload");
    },
  },
  {
    name: "a contact is not overdue while frames come in",
    scenario: "rich",
    async run(s) {
      await s.steer({ contact: { received_s_ago: 0, due_s_ago: 4 } });
      await s.shows("#vehicle dl", /Next contact\s+T\+[\d:]+, now/);
      await s.steer({ contact: { received_s_ago: 300, due_s_ago: 290 } });
      await s.shows("#vehicle dl", /Next contact\s+T\+[\d:]+, overdue/);
    },
  },
  {
    name: "what places the camera frames is shown, with closed loops on the map",
    scenario: "rich",
    async run(s) {
      await s.shows("#vehicle dl", /Camera frames\s+\u2013/);
      const report = { at_s: 5, share: 1, sigma_m: 0.04, closed: 12 };
      await s.steer({ registration: { ...report, tie: "earlier_track" } });
      await s.shows("#vehicle dl", /Camera frames\s+by an earlier track, \u00b1 0\.04\sm, 12 closed loops/);
      const lost = () => s.page.locator("#vehicle .warn", { hasText: "Camera frames" });
      assert.equal(await lost().count(), 0);
      const place = await s.inPage(({ store, view, onMap }) => {
        const box = document.getElementById("chart").getBoundingClientRect();
        return onMap(store.vehicle, ...view.toWorld(box.width * 0.15, box.height * 0.85));
      });
      const ring = () =>
        s.inPage(({ store, view, inWorld, ink }, [x, y]) => {
          const [px, py] = view.toScreen(...inWorld(store.vehicle, x, y)).map(Math.round);
          const c = document.getElementById("chart").getContext("2d");
          const track = ink("--map-track");
          const pixels = c.getImageData(px - 6, py - 6, 13, 13).data;
          return [...Array(169).keys()].filter((i) => track.every((w, n) => Math.abs(w - pixels[4 * i + n]) < 60)).length;
        }, place);
      const before = await ring();
      await s.steer({ closed_loops: [[5, ...place]] });
      await s.until("a ring on the map", async () => (await ring()) > before + 8);
      await s.steer({ registration: { ...report, tie: "odometry", share: 0.5, sigma_m: 0.3 } });
      await s.shows("#vehicle dl", /Camera frames\s+lost, by odometry, \u00b1 0\.30\sm, 50 % of the last 32 by images, 12 closed loops/);
      await s.until("a warning", async () => (await lost().count()) === 1);
    },
  },
  {
    name: "the vehicle's status is shown with its age",
    ends: true,
    async run(s) {
      await s.shows("#vehicle .age", /Status .* old · received .* ago, due every/, { ms: 60000, advance: 5 });
      const [depth, shown] = await s.inPage(({ store }) => [-store.vehicle.status.z_m, document.querySelector("#vehicle .values").innerText]);
      assert.ok(shown.replaceAll("\u202f", " ").replaceAll("\u2212", "-").includes(`${depth.toFixed(1)} m`), shown);
    },
  },
  {
    name: "hold is confirmed first; cancelling sends nothing",
    ends: true,
    async run(s) {
      const open = s.page.locator("#hold");
      await open.click();
      await s.button("Cancel").click();
      assert.equal(s.posts.length, 0);
      await open.click();
      await s.button("Hold").click();
      await s.shows("#vehicle .steps", /Queued/);
      assert.deepEqual(s.posts.at(-1).body, { action: "hold" });
    },
  },
  {
    name: "a held vehicle shows its mode and can resume",
    scenario: "rich",
    async run(s) {
      await s.post("/vehicles/1/constraints", { action: "hold" });
      await s.shows("#vehicle .mode", /hold/, { advance: 4 });
      await s.shows("#banners", /does not survey.*holding: order/s);
      await s.page.locator("#hold").click();
      await s.button("Resume").click();
      await s.shows("#vehicle .mode", /survey/, { advance: 4 });
    },
  },
  {
    name: "a late joiner sees the orders of others",
    long: true,
    scenario: "rich",
    async run(s) {
      await s.post("/vehicles/1/utility", { weights: { 1: 0.5 }, exploration: 0.2 });
      await s.post("/vehicles/1/constraints", { action: "hold" });
      const late = await s.context.newPage();
      await late.goto(s.url);
      await late.locator(".slots", { hasText: "Hold" }).waitFor();
      await s.until("the weight", async () => (await late.getByRole("slider", { name: "Weight of Label 1", exact: true }).inputValue()) === "0.5");
    },
  },
  {
    name: "a late joiner sees the fence and limits in force",
    scenario: "rich",
    async run(s) {
      const applied = (slot) => async () => (await s.vehicle()).directive.slots.find((x) => x.slot === slot)?.state === "applied";
      await s.steer({ loss: 0 });
      await s.post("/vehicles/1/fence", { fence: [[-11, -8], [18, -8], [18, 14], [-11, 14]] });
      await s.post("/vehicles/1/limits", { depth_m: [5, 30], on_silence: "return" });
      await s.until("the fence", applied("fence"), { advance: 4 });
      await s.until("the limits", applied("limits"), { advance: 4 });
      await s.steer({ loss: 1 });
      await s.post("/vehicles/1/fence", { fence: [[-12, -9], [19, -9], [19, 15]] });
      await s.post("/vehicles/1/limits", { silence_s: 300 });
      await s.page.reload();
      await s.ready();
      await s.page.getByRole("tab", { name: "Constraints" }).click();
      await s.shows("[aria-labelledby=fence-title] .note", /Version 1 stays in force meanwhile/);
      await s.shows("[aria-labelledby=limits-title] .note", /In force meanwhile: version 1: depth, m 5 to 30; on silence return/);
    },
  },
];
