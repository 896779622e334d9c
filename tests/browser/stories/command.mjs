import assert from "node:assert/strict";

const CREW = [
  { name: "anna", role: "operator" }, { name: "bob", role: "operator" },
  { name: "carla", role: "administrator" }, { name: "victor", role: "viewer" },
];

/** Logs the story's page in as one of the crew. */
async function as(s, name, context = s.context, page = s.page) {
  await context.addCookies([{ name: "principal", value: name, url: s.url }]);
  await page.goto(s.url);
  await page.waitForFunction(() => document.body.dataset.feed === "open");
  await s.until("the principal", () => page.evaluate(async () => (await import("/js/command.js")).principal()?.name), {});
}

/** Runs a part of a story with the page of a second browser. */
async function inSecondBrowser(s, run) {
  const context = await s.browser.newContext();
  try {
    await s.watch(context);
    await run(await context.newPage(), context);
  } finally {
    await context.close();
  }
}

const crewWithAnna = (s) => s.steer({ principals: CREW, commander: "anna" });
const weigh = (s) => s.page.locator("#exploration").fill("0.5");

export default [
  {
    name: "a viewer reads, and every order is disabled with the reason",
    scenario: "rich",
    async run(s) {
      await s.steer({ principals: CREW });
      await as(s, "victor");
      await weigh(s);
      await s.shows("#send .denied", /needs the role operator; yours is viewer/);
      for (const id of ["send-weights", "hold", "abort", "planner"]) {
        await s.until(`${id} to be disabled`, () => s.page.locator(`#${id}`).isDisabled());
      }
      await s.shows("#vehicle .denied", /needs the role operator/);
      await s.page.locator("#command").click();
      await s.shows("#dialog", /You are victor, viewer/);
      assert.equal(await s.button("Take command").count(), 0);
      const answer = await s.page.evaluate(() => fetch("/api/v2/vehicles/1/constraints", { method: "POST", headers: { "x-scenecast": "1" }, body: '{"action": "hold"}' }).then((r) => r.status));
      assert.equal(answer, 403);
    },
    tolerates: /403/,
  },
  {
    name: "without command an operator stops the vehicle and sends no other order",
    scenario: "rich",
    async run(s) {
      await crewWithAnna(s);
      await as(s, "bob");
      await s.shows("#command", /anna has command/);
      await weigh(s);
      await s.shows("#send .denied", /anna has command/);
      assert.ok(await s.page.locator("#send-weights").isDisabled());
      await s.page.locator("#hold").click();
      await s.button("Hold").click();
      await s.until("the order", () => s.posts.some((p) => p.path.endsWith("/constraints") && p.body.action === "hold"));
      await s.page.locator("#abort").click();
      await s.page.locator(".sure input").check();
      await s.button("Abort").click();
      await s.until("the abort", () => s.posts.some((p) => p.path.endsWith("/constraints") && p.body.action === "abort"));
      await s.shows("#command", /anna has command/);
      assert.equal(await s.page.locator("#vehicle .error").first().innerText(), "");
    },
  },
  {
    name: "an operator with command may not change settings",
    scenario: "rich",
    async run(s) {
      await crewWithAnna(s);
      await as(s, "anna");
      await s.shows("#command", /You have command/);
      await s.page.getByRole("tab", { name: "Scene model" }).or(s.page.getByRole("tab", { name: "Model" })).first().click();
      await s.shows("#model .denied", /needs the role administrator; yours is operator/);
      assert.ok(await s.page.locator("#send-settings").isDisabled());
    },
  },
  {
    name: "command is requested on one page and handed over on another",
    scenario: "rich",
    async run(s) {
      await crewWithAnna(s);
      await as(s, "anna");
      await inSecondBrowser(s, async (page, context) => {
        await as(s, "bob", context, page);
        await page.locator("#command").click();
        await page.getByRole("button", { name: "Request command", exact: true }).click();
        await s.shows(".banner", /bob requests command/);
        await s.page.locator(".banner button").click();
        await s.shows("#command", /bob has command/);
        await s.until("the other page to have command", async () => /You have command/.test(await page.locator("#command").innerText()));
        const history = await page.locator("ol.changes").innerText();
        assert.match(history, /anna handed command over to bob[\s\S]*bob requested command from anna/);
        await weigh(s);
        await s.until("the weights to be refused", () => s.page.locator("#send-weights").isDisabled());
      });
    },
  },
  {
    name: "of two browsers without tokens only one has command, and the other one moves it",
    scenario: "rich",
    async run(s) {
      await s.page.locator("#command").click();
      await s.button("Close").click();
      await s.shows("#command", /Nobody has command/);
      await weigh(s);
      await s.page.locator("#send-weights").click();
      await s.shows("#command", /You have command/);
      await inSecondBrowser(s, async (page) => {
        await page.goto(s.url);
        const caption = page.locator("#command");
        await s.until("the other browser to say so", async () => /Command is elsewhere/.test(await caption.innerText()));
        await page.locator("#exploration").fill("0.2");
        await s.until("the weights to be refused", () => page.locator("#send-weights").isDisabled());
        assert.match(await page.locator("#send .denied").innerText(), /local has command at another client: take it/);
        await caption.click();
        await page.getByRole("button", { name: "Take command", exact: true }).click();
        await s.until("the other browser to have command", async () => /You have command/.test(await caption.innerText()));
        await s.shows("#command", /Command is elsewhere/);
        assert.match(await page.locator("ol.changes").innerText(), /local moved command to another client/);
      });
    },
  },
  {
    name: "command is taken after two minutes of silence",
    scenario: "rich",
    async run(s) {
      await crewWithAnna(s);
      await as(s, "bob");
      await s.page.locator("#command").click();
      assert.ok(await s.button("Take command").isDisabled());
      await s.steer({ advance: 121 });
      await s.until("the silence", () => s.button("Take command").isEnabled());
      await s.button("Take command").click();
      await s.shows("#command", /You have command/);
      await s.shows("ol.changes", /bob took command from anna, who was silent/);
    },
  },
  {
    name: "another surface that holds the vehicle is named and can be taken over",
    scenario: "rich",
    async run(s) {
      await s.steer({ principals: CREW });
      await as(s, "bob");
      const other = { name: "tender", holds: false, heard_s: 0, is_silent: false, is_taken_over: false };
      await s.steer({ other_surface: other });
      await s.shows("#banners", /The surface tender calls auv-1/);
      await s.steer({ other_surface: { ...other, holds: true } });
      await s.shows("#banners", /The surface tender holds auv-1.*An administrator may take the vehicle over, or an operator after 120 s/s);
      assert.equal(await s.button("Take over").count(), 0);
      await s.steer({ other_surface: { ...other, holds: true, is_silent: true } });
      await s.button("Take over").click();
      await s.shows("#banners", /This surface takes it over/);
      await s.steer({ other_surface: null });
      await s.visible("#banners", false);
    },
  },
  {
    name: "a withdrawn order is sent again only if an operator wishes it",
    scenario: "rich",
    async run(s) {
      const post = (path, body) => s.page.evaluate(([path, body]) => fetch(`/api/v2/vehicles/1/${path}`, { method: "POST", headers: { "x-scenecast": "1", "x-scenecast-client": "story" }, body: JSON.stringify(body) }).then((r) => r.status), [path, body]);
      await post("limits", { time_s: 600 });
      await post("constraints", { action: "abort" });
      await s.steer({ withdraw: { constraints: "it has not arrived in time: is it still to be sent?" } });
      await s.shows("#banners", /auv-1: abort is withdrawn.*has not arrived in time/s);
      await s.button("Send abort again").click();
      await s.until("the order", () => s.posts.some((p) => p.path.endsWith("/orders/again") && p.body.slot === "constraints"));
      await s.visible("#banners", false);
      await s.steer({ withdraw: { limits: "the vehicle has no record of it any more: is it to be sent again?" } });
      await s.shows("#banners", /auv-1 has lost its orders.*no record any more of: limits \(time 600 s\)/s);
      await s.button("Send them again").click();
      await s.until("the orders", () => s.posts.some((p) => p.path.endsWith("/orders/restore")));
      await s.visible("#banners", false);
    },
  },
];
