import assert from "node:assert/strict";

const greyed = (s, wanted = true) => s.visible("#map-age.stale", wanted);

export default [
  {
    name: "an announcement does not replace one before it, and equal ones in a burst are one",
    scenario: "rich",
    async run(s) {
      const spoken = () => s.page.locator("#announce > span").allInnerTexts();
      await s.page.evaluate(async () => {
        const { announce } = await import("/js/dom.js");
        for (const message of ["Utility: Applied", "Fence: Refused", "Fence: Refused"]) announce(message);
      });
      assert.deepEqual((await spoken()).slice(-2), ["Utility: Applied", "Fence: Refused"]);
      await s.steer({ silent: true, advance: 200 });
      await s.until("the silence", async () => (await spoken()).some((line) => / is silent/.test(line)));
      assert.ok((await spoken()).includes("Fence: Refused"), "the announcement before it is still there");
      await s.page.evaluate(async () => {
        const { announce } = await import("/js/dom.js");
        for (let i = 0; i < 50; i += 1) announce(`line ${i}`);
      });
      assert.equal((await spoken()).length, 20);
    },
  },
  {
    name: "a silent vehicle has a lasting banner and everything of it is stale",
    scenario: "silent",
    async run(s) {
      await s.shows("#banners", /auv-1 is silent.*expected every 12 s.*(Next contact in|Contact was due)/s);
      await greyed(s);
      assert.equal(await s.page.locator("#vehicle.stale").count(), 1);
      assert.match(await s.page.title(), /silent/);
      await s.steer({ silent: false, advance: 14, loss: 0 });
      await s.visible("#banners", false);
      await greyed(s, false);
    },
  },
  {
    name: "a late frame within three intervals raises no alarm",
    scenario: "rich",
    async run(s) {
      await s.steer({ loss: 0, advance: 13 });
      const { now_s: now } = await s.steer({ silent: true, advance: 20 });
      const { last_received_s: last } = await s.vehicle();
      assert.ok(now - last < 34);
      await s.until("the late state", () => s.inPage(({ store }, at) => store.snapshot.now_s >= at, now));
      await s.shows("#vehicles", /received/);
      assert.equal(await s.page.locator("#banners").isVisible(), false);
    },
  },
  {
    name: "ages grow between messages",
    scenario: "silent",
    stopped: true,
    async run(s) {
      const age = () => s.page.locator("#map-age").innerText();
      await s.shows("#map-age", /\d/, { tick: 50 });
      await s.steer({ mute: true });
      const first = await age();
      await s.until("the age to grow", async () => (await age()) !== first, { tick: 1000 });
    },
  },
  {
    name: "without the daemon everything is stale until it returns",
    scenario: "rich",
    async run(s) {
      await s.steer({ down: true });
      await s.shows("#banners", /No connection to scenecast.*trying/s);
      await s.shows("#feed", /Not connected/);
      await greyed(s);
      assert.equal(await s.page.locator("#link.stale").count(), 1);
      assert.ok(await s.page.locator("#hold").isDisabled());
      await s.steer({ down: false });
      await s.shows("#feed", /Live/);
      await s.visible("#banners", false);
    },
    tolerates: /ERR_|Failed to load/,
  },
  {
    name: "the pause between attempts grows, and the operator can try at once",
    long: true,
    scenario: "rich",
    stopped: true,
    async run(s) {
      await s.steer({ stream: false });
      await s.until("a pause of seconds", () => s.inPage(({ store }) => store.feed.retryMs - performance.now() > 7000), { tick: 500 });
      await s.steer({ stream: true });
      // The clock of the page stands still: no timer makes this attempt.
      await s.button("Try now").click();
      await s.shows("#feed", /Live/);
    },
    tolerates: /503|Failed to load/,
  },
  {
    name: "a stream that falls silent counts as lost",
    scenario: "rich",
    stopped: true,
    async run(s) {
      await s.steer({ mute: true });
      await s.shows("#feed", /Not connected/, { tick: 1000 });
      await s.steer({ mute: false });
      await s.shows("#feed", /Live/, { tick: 250 });
    },
  },
  {
    name: "a restarted daemon replaces the old map even under the same version",
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
    name: "a mission that has ended is no alarm",
    scenario: "rich",
    async run(s) {
      await s.steer({ ended: true });
      await s.shows("#banners", /The mission has ended/);
      assert.equal(await s.page.locator(".banner").count(), 1);
    },
  },
  {
    name: "a map that the server cannot send is reported with the reason",
    scenario: "rich",
    async run(s) {
      const reason = "the map spans 4000000001 x 10 cells: at most 8388608 are sent";
      await s.page.route("**/vehicles/1/map/tiles*", (route) => route.fulfill({ status: 422, contentType: "application/json", body: JSON.stringify({ error: reason }) }));
      await s.steer({ loss: 0, advance: 14 });
      await s.shows("#banners", /map of auv-1 is not up to date.*4000000001 x 10 cells/s);
      await s.page.unroute("**/vehicles/1/map/tiles*");
      await s.until("the banner to go", async () => !(await s.page.locator("#banners").isVisible()), { advance: 14 });
    },
    tolerates: /422/,
  },
];
