import assert from "node:assert/strict";

/** Counts the tones that the page plays from now on, as `tones` of its window. */
const countTones = (s) =>
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
    name: "the vehicle's status is shown with its age",
    async run(s) {
      await s.shows("#vehicle .age", /Status .* old · received .* ago, due every/, { ms: 60000, advance: 5 });
      const [depth, shown] = await s.inPage(({ store }) => [-store.vehicle.status.z_m, document.querySelector("#vehicle .values").innerText]);
      assert.ok(shown.replaceAll("\u202f", " ").replaceAll("\u2212", "-").includes(`${depth.toFixed(1)} m`), shown);
    },
  },
  {
    name: "hold is confirmed first; cancelling sends nothing",
    async run(s) {
      const open = s.page.locator("#hold");
      await open.click();
      await s.button("Cancel").click();
      assert.equal(s.posts.length, 0);
      await open.click();
      await s.button("Hold").click();
      await s.shows("#vehicle .steps", /Queued/);
      assert.deepEqual(s.posts.at(-1).body, { hold: true });
    },
  },
  {
    name: "a held vehicle shows its mode and can resume",
    scenario: "rich",
    async run(s) {
      await s.post("/vehicles/1/constraints", { hold: true });
      await s.shows("#vehicle .mode", /hold/, { advance: 4 });
      await s.page.locator("#hold").click();
      await s.button("Resume").click();
      await s.shows("#vehicle .mode", /survey/, { advance: 4 });
    },
  },
  {
    name: "a late joiner sees the orders of others",
    scenario: "rich",
    async run(s) {
      await s.post("/vehicles/1/utility", { weights: { 1: 0.5 }, exploration: 0.2 });
      await s.post("/vehicles/1/constraints", { hold: true });
      const late = await s.context.newPage();
      await late.goto(s.url);
      await late.locator(".slots", { hasText: "Hold, abort" }).waitFor();
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
