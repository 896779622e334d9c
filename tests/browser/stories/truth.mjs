import assert from "node:assert/strict";

const banner = (s) => s.page.locator("#banners");
const greyed = (s) => s.page.locator("#map-age.stale").isVisible();

export default [
  {
    name: "a silent vehicle has a lasting banner with the next contact, and all of it is marked stale",
    scenario: "silent",
    async run(s) {
      await s.shows("#banners", /auv-1 is silent.*expected every 12 s.*(Next contact in|Contact was due)/s);
      assert.ok(await greyed(s));
      assert.equal(await s.page.locator("#vehicle.stale").count(), 1);
      assert.match(await s.page.title(), /silent/);
      await s.steer({ silent: false, advance: 14, loss: 0 });
      await s.until("the banner to go", async () => !(await banner(s).isVisible()));
      assert.equal(await greyed(s), false);
    },
  },
  {
    name: "a late frame within three intervals raises no alarm",
    scenario: "rich",
    async run(s) {
      await s.steer({ loss: 0, advance: 13 });
      await s.steer({ silent: true, advance: 20 });
      const { now_s: now, vehicles } = await s.get("/state");
      assert.ok(now - vehicles[0].heard_s < 34);
      await s.shows("#vehicles", /heard/);
      assert.equal(await banner(s).isVisible(), false);
    },
  },
  {
    name: "ages grow between messages",
    scenario: "silent",
    async run(s) {
      const age = () => s.page.locator("#map-age").innerText();
      const first = await age();
      await s.until("the age to grow", async () => (await age()) !== first);
    },
  },
  {
    name: "without the daemon everything is stale, it says so, and it comes back by itself",
    scenario: "rich",
    async run(s) {
      await s.steer({ down: true });
      await s.shows("#banners", /No connection to scenecast.*trying/s);
      await s.shows("#feed", /Not connected/);
      assert.ok(await greyed(s));
      assert.equal(await s.page.locator("#link.stale").count(), 1);
      assert.ok(await s.page.locator("#hold").isDisabled());
      await s.steer({ down: false });
      await s.shows("#feed", /Live/);
      await s.until("the banner to go", async () => !(await banner(s).isVisible()));
    },
    tolerates: /ERR_|Failed to load/,
  },
  {
    name: "the pause between attempts grows, and the operator can try at once",
    scenario: "rich",
    async run(s) {
      await s.steer({ stream: false });
      await s.until("a pause of seconds", () => s.inPage(({ store }) => store.feed.retryMs - performance.now() > 7000));
      await s.steer({ stream: true });
      await s.button("Try now").click();
      await s.shows("#feed", /Live/, { ms: 5000 });
    },
    tolerates: /503|Failed to load/,
  },
  {
    name: "a stream that falls quiet counts as lost",
    scenario: "rich",
    async run(s) {
      await s.steer({ mute: true });
      await s.shows("#feed", /Not connected/);
      await s.steer({ mute: false });
      await s.shows("#feed", /Live/);
    },
  },
  {
    name: "a daemon that started afresh replaces the old map even under the same version",
    scenario: "rich",
    async run(s) {
      await s.steer({ scenario: "start" });
      await s.until("the new map", async () => {
        const { map } = await s.vehicle();
        return (await s.inPage(({ store }) => store.map.width)) === map.width;
      });
    },
  },
  {
    name: "a mission that ended is no alarm",
    scenario: "rich",
    async run(s) {
      await s.steer({ ended: true });
      await s.shows("#banners", /The mission has ended/);
      assert.equal(await s.page.locator(".banner").count(), 1);
    },
  },
  {
    name: "a map that cannot be told says why",
    scenario: "rich",
    async run(s) {
      const why = "the map spans 4000000001 x 10 cells: at most 8388608 are told";
      await s.page.route("**/vehicles/1/map", (route) => route.fulfill({ status: 422, contentType: "application/json", body: JSON.stringify({ error: why }) }));
      await s.steer({ loss: 0, advance: 14 });
      await s.shows("#banners", /map of auv-1 is not up to date here.*4000000001 x 10 cells/s);
      await s.page.unroute("**/vehicles/1/map");
      await s.until("the banner to go", async () => !(await banner(s).isVisible()), { advance: 14 });
    },
    tolerates: /422/,
  },
];
