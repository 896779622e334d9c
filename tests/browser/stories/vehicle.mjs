import assert from "node:assert/strict";

export default [
  {
    name: "the vehicle's status is shown with its age",
    async run(s) {
      await s.shows("#vehicle .age", /Status .* old · heard .* ago, due every/, { ms: 60000, advance: 5 });
      const { status } = await s.inPage(({ store }) => ({ status: store.vehicle.status }));
      const shown = (await s.page.locator("#vehicle .values").innerText()).replaceAll("\u202f", " ").replaceAll("\u2212", "-");
      assert.ok(shown.includes(`${(-status.z_m).toFixed(1)} m`), shown);
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
    name: "a late joiner sees what others have sent",
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
];
