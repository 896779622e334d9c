import assert from "node:assert/strict";

const bits = (text) => text.replaceAll("\u202f", " ");

export default [
  {
    name: "a budget that was lowered is judged from its change on",
    scenario: "rich",
    async run(s) {
      await s.until("a rate", async () => (await s.get("/state")).link.up.max_window_bps > 200, { advance: 2 });
      await s.page.locator("#budget").fill("100");
      await s.page.locator(".budget").getByRole("button", { name: "Set" }).click();
      await s.until("the budget", async () => (await s.get("/state")).link.budget_bps === 100);
      await s.until("no direction to be over the budget", async () => (await s.page.locator("#link .bar.over").count()) === 0);
      await s.shows("#link .steps", /Version \d+|Queued|On air/);
    },
  },
  {
    name: "loss is not known while no frame comes in",
    scenario: "silent",
    async run(s) {
      await s.shows("#link dl", /Recent loss, up \/ down\s+not known/);
    },
  },
  {
    name: "the link shows rate, budget line, loss and bits by class",
    async run(s) {
      await s.shows("#link .direction", /max\. in \d+ s: \d+ % of budget/);
      const { link, layers } = await s.get("/state");
      assert.equal(await s.page.locator("#budget").inputValue(), String(link.budget_bps));
      const rows = await s.page.locator(".classes tbody tr").allInnerTexts();
      const names = layers.map((l) => l.name).sort();
      assert.ok(names.includes("depth"), `${names}`);
      assert.deepEqual(rows.map((r) => r.trim().split(/\s/)[0]), ["map", ...names, "status", "directive", "fix", "exemplar", "overhead"]);
      await s.until("the history to be drawn", () => s.page.locator("#link canvas").evaluate((c) => {
        const { data } = c.getContext("2d").getImageData(0, 0, c.width, c.height);
        return data.some((v, i) => i % 4 === 3 && v > 0);
      }));
    },
  },
  {
    name: "the budget says what its shares bring, also before they are set",
    async run(s) {
      const [map, exemplar, free] = [0, 1, 2].map((i) => s.page.locator(".shares .brings").nth(i));
      const says = async (line) => bits(await line.innerText());
      await s.until("a report of the vehicle", async () => /current/.test(await says(map)));
      assert.match(await says(exemplar), /^(an image takes|.*: image in) about /);
      assert.match(await says(free), /images of the sea floor/);
      const before = Number(/about (\d+) s/.exec(await says(exemplar))[1]);
      await s.page.locator('.budget ~ input[type="range"]').first().evaluate((slider) => {
        slider.value = 0.25;
        slider.dispatchEvent(new Event("input"));
      });
      const after = /about (?:(\d+) min )?(\d+) s, now \d+ s/.exec(await says(exemplar));
      assert.ok(after && 60 * Number(after[1] ?? 0) + Number(after[2]) > before, await says(exemplar));
      assert.equal(s.posts.length, 0);
    },
  },
  {
    name: "a new budget is sent and its status shown",
    ends: true,
    async run(s) {
      await s.page.locator("#budget").fill("6000");
      await s.page.locator(".budget").getByRole("button", { name: "Set" }).click();
      await s.until("the message", () => s.posts.length > 0);
      assert.deepEqual(s.posts.at(-1).body, { budget_bps: 6000 });
      await s.shows("#link .steps [aria-current]", /Applied/, { ms: 240000, advance: 2 });
      await s.until("the new line", async () => (await s.get("/state")).link.budget_bps === 6000);
    },
  },
  {
    name: "a budget out of range is refused with the reason",
    scenario: "rich",
    async run(s) {
      await s.page.locator("#budget").fill("7");
      await s.page.locator(".budget").getByRole("button", { name: "Set" }).click();
      await s.shows("#link .error", /budget_bps must be 100 to 100000/);
    },
    tolerates: /422/,
  },
  {
    name: "a dragged share is sent on release, and the sum stays within 100",
    long: true,
    async run(s) {
      const { link: { shares } } = await s.get("/state");
      const handle = s.page.locator(".handle[title$='exemplar']");
      await handle.scrollIntoViewIfNeeded();
      const [from, bar] = [await handle.boundingBox(), await s.page.locator(".stack").boundingBox()];
      const y = from.y + from.height / 2;
      const less = (2 * bar.width) / 100;
      await s.page.mouse.move(from.x + from.width / 2, y);
      await s.page.mouse.down();
      await s.page.mouse.move(from.x + from.width / 2 - less, y, { steps: 4 });
      assert.equal(s.posts.length, 0, "no message before the release");
      await s.page.mouse.up();
      await s.until("the message", () => s.posts.length > 0);
      const sent = s.posts.at(-1).body.shares;
      assert.equal(sent.exemplar, Math.max(0, shares.exemplar - 2));
      await s.until("the server's shares", async () => (await s.get("/state")).link.shares.exemplar === sent.exemplar);
      const map = s.page.getByRole("slider", { name: "Minimum share of map, percent" });
      await map.fill("100");
      await s.until("the second message", () => s.posts.length > 1);
      const all = Object.values(s.posts.at(-1).body.shares).reduce((a, b) => a + b, 0);
      assert.equal(all, 100);
      await s.shows("#link .steps [aria-current]", /Applied/, { ms: 240000, advance: 2 });
    },
  },
  {
    name: "budget and shares follow the keys, and a run of keys is one message",
    stopped: true,
    async run(s) {
      const map = s.page.getByRole("slider", { name: "Minimum share of map, percent" });
      const was = Number(await map.inputValue());
      await map.focus();
      for (let i = 0; i < 3; i += 1) await s.page.keyboard.press("ArrowLeft");
      assert.equal(s.posts.length, 0);
      await s.until("the message", () => s.posts.length > 0, { tick: 100 });
      assert.equal(s.posts.length, 1);
      assert.equal(s.posts[0].body.shares.map, was - 3);
      // Until then the page sends them again beside the next change.
      await s.until("the server's shares on the page", () => s.inPage(({ store }, map) => store.snapshot.link.shares.map === map, was - 3), { tick: 100 });
      await s.page.getByRole("slider", { name: "Budget, logarithmic" }).focus();
      await s.page.keyboard.press("ArrowLeft");
      await s.until("the budget", () => s.posts.length > 1, { tick: 100 });
      assert.equal(s.posts[1].body.shares, undefined);
    },
  },
  {
    name: "the operator orders the background streams and removes one",
    ends: true,
    async run(s) {
      const box = s.page.getByRole("group", { name: "Use of spare capacity" });
      await box.getByRole("button", { name: "Earlier: images of new labels" }).click();
      await box.getByRole("button", { name: "Earlier: images of new labels" }).click();
      await box.getByRole("checkbox", { name: "confidence" }).uncheck();
      const wanted = ["exemplars", "finer", "depth", "floor"];
      await s.until("the server's order", async () => (await s.get("/state")).link.background.join() === wanted.join());
      // The new state may arrive before the event of the request.
      await s.until("the message", () => s.posts.at(-1)?.body.background?.length === wanted.length);
      assert.deepEqual(s.posts.at(-1).body.background, wanted);
      assert.equal(s.posts.at(-1).body.shares, undefined);
      await s.page.reload();
      await s.ready();
      assert.equal(await box.getByRole("checkbox", { name: "confidence" }).isChecked(), false);
    },
  },
  {
    name: "refused shares return to those in force, with the reason",
    long: true,
    scenario: "rich",
    async run(s) {
      await s.page.route("**/budget", (route) => route.fulfill({ status: 422, contentType: "application/json", body: '{"error":"shares add up to 130 percent: allowed is 100 or less"}' }));
      const map = s.page.getByRole("slider", { name: "Minimum share of map, percent" });
      await map.fill("30");
      await s.shows("#link .error", /shares add up to 130 percent/);
      await s.until("the old share", async () => (await map.inputValue()) === "50");
    },
    tolerates: /422/,
  },
  {
    name: "a budget changed by another console is shown as such",
    long: true,
    scenario: "rich",
    async run(s) {
      await s.page.getByRole("slider", { name: "Minimum share of fix, percent" }).fill("2");
      await s.until("the message", () => s.posts.length > 0);
      await s.until("its version", async () => (await s.vehicle()).directive.slots.some((x) => x.slot === "budget" && x.version === 1));
      await s.post("/budget", { budget_bps: 4000 });
      await s.shows("#link .replaced", /Changed by another console \(version 2\)/);
      await s.until("the other budget", async () => (await s.page.locator("#budget").inputValue()) === "4000");
    },
  },
  {
    name: "the backlog shows its end, and the map its lag",
    ends: true,
    async run(s) {
      const { link: { budget_bps } } = await s.get("/state");
      await s.post("/vehicles/1/constraints", { action: "resume" });
      await s.post("/budget", { budget_bps: 400 });
      await s.until("a backlog", async () => (await s.vehicle()).link.backlog?.bits > 0, { ms: 120000, advance: 2 });
      const shown = async () => bits(await s.page.locator("#link .values").innerText());
      await s.until("its end", async () => /Backlog\s+\S+ k?bit, empty in \d+ .*reported \d+ s ago/.test(await shown()), { ms: 120000, advance: 2 });
      await s.until("the lag", async () => /Map lag\s+\d+ (s|min).*, \S+ k?bit/.test(await shown()));
      await s.post("/budget", { budget_bps });
    },
  },
  {
    name: "the backlog of a silent vehicle shows its age and that no data arrives",
    scenario: "silent",
    async run(s) {
      await s.steer({ advance: 650 });
      await s.shows("#link .values", /Backlog\s+\S+ k?bit, no data received, reported \d+ min/);
      await s.shows("#link .values", /Map lag\s+more than \d+ min.*, \S+ k?bit/);
      await s.until("both to be grey", async () => (await s.page.locator("#link .whole.stale").count()) === 2);
    },
  },
];
