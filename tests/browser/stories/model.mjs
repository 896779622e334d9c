import assert from "node:assert/strict";
import { PHONE } from "../stage.mjs";

const open = (s) => s.page.getByRole("tab", { name: "Model" }).click();
const field = (s, key) => s.page.locator(`#set-${key}`);
const send = (s) => s.page.locator("#send-settings");
const sent = (s) => s.posts.filter((p) => p.path.endsWith("/settings")).map((p) => p.body);
const force = (s, key) => s.page.locator(".limit", { has: field(s, key) }).locator(".note");

export default [
  {
    name: "settings are checked while typed, sent, and shown in force",
    ends: true,
    async run(s) {
      await s.shows("#vehicle .age", /Status/, { ms: 60000, advance: 5 });
      await open(s);
      await field(s, "gamma").fill("5000");
      await s.shows("#gamma-fault", /The range is 1e-12 to 1000, or 0 for the vehicle's default/);
      assert.ok(await send(s).isDisabled());
      await field(s, "gamma").fill("1e-5");
      await field(s, "frames_per_s").fill("0.001");
      await s.shows("#frames_per_s-fault", /0.01 to 30/);
      await field(s, "frames_per_s").fill("0.25");
      await field(s, "layers").selectOption("depth");
      await field(s, "cells").selectOption("coarse-to-fine");
      await s.until("the value in force beside the draft", () => force(s, "gamma").isVisible());
      await send(s).click();
      await s.until("the message", () => sent(s).length === 1);
      const { gamma, frames_per_s: frames, layers, cells } = sent(s)[0];
      assert.deepEqual([gamma, frames, layers, cells], [1e-5, 0.25, "depth", "coarse-to-fine"]);
      await s.shows("#model .steps [aria-current]", /Applied/, { ms: 240000, advance: 2 });
      // A version before this one may have been applied, too.
      await s.until("the settings in force", async () => (await s.vehicle()).settings.in_force?.gamma === 1e-5, { ms: 240000, advance: 2 });
      await s.until("no other value in force", async () => !(await force(s, "gamma").isVisible()));
    },
  },
  {
    name: "a cleared field means the default, an empty one unchanged",
    long: true,
    scenario: "rich",
    async run(s) {
      await open(s);
      assert.equal(await field(s, "alpha").getAttribute("placeholder"), "unchanged");
      await field(s, "alpha").fill("0.5");
      await send(s).click();
      await s.shows("#model .steps [aria-current]", /Applied/, { advance: 2 });
      assert.deepEqual(sent(s)[0], { alpha: 0.5 });
      await field(s, "alpha").fill("");
      await s.page.locator("#model-title").click();
      await s.until("the placeholder", async () => (await field(s, "alpha").getAttribute("placeholder")) === "the vehicle's default");
      await send(s).click();
      await s.until("the message", () => sent(s).length === 2);
      assert.deepEqual(sent(s)[1], { alpha: 0 });
    },
  },
  {
    name: "registration is switched off and returns to the vehicle's default",
    long: true,
    async run(s) {
      await open(s);
      for (const choice of ["off", ""]) {
        await field(s, "registration").selectOption(choice);
        await send(s).click();
        await s.until("the message", () => sent(s).at(-1)?.registration === choice);
        await s.until("the choice in force", async () => (await s.vehicle()).settings.in_force.registration === choice, { advance: 2 });
      }
    },
  },
  {
    name: "fit to budget fills the fields, names the trade-off, and sends no order",
    long: true,
    scenario: "rich",
    async run(s) {
      await open(s);
      await field(s, "layers").selectOption("none");
      await s.page.locator("#fit-bps").fill("1000");
      await s.button("Fit to budget").click();
      await s.shows("#fitted", /a stream of 800 bit\/s\. Fewer labels, fewer camera frames: 0\.02 nats \(6 %\) below the best/);
      assert.equal(await field(s, "labels").inputValue(), "9");
      assert.equal(await field(s, "cells").inputValue(), "fine");
      assert.equal(await field(s, "layers").inputValue(), "none");
      assert.equal(sent(s).length, 0);
      await send(s).click();
      await s.until("the message", () => sent(s).length === 1);
      assert.deepEqual(sent(s)[0], { labels: 9, frames_per_s: 0.2, cells: "fine", layers: "none" });
      await s.shows("#model .steps [aria-current]", /Applied/, { advance: 2 });
      assert.equal(await s.page.locator("#model .replaced").isVisible(), false);
    },
  },
  {
    name: "where no settings fit, the lowest rate is shown",
    scenario: "rich",
    async run(s) {
      await open(s);
      await s.page.locator("#fit-bps").fill("50");
      await s.page.locator("#fit-bps").press("Enter");
      await s.shows("#model .error:not(:empty)", /no setting fits 50 bit\/s: the lowest rate is 90 bit\/s/);
      assert.equal(await field(s, "alpha").inputValue(), "");
      await s.page.locator("#fit-bps").fill("0");
      await s.button("Fit to budget").click();
      await s.shows("#model .error:not(:empty)", /The range is 1 to 10000000 bit\/s/);
      assert.ok(await send(s).isDisabled());
    },
  },
  {
    name: "refused settings show the reason; the planner's order counts as ours",
    scenario: "rich",
    size: PHONE,
    async run(s) {
      await s.steer({ refuse: "settings" });
      await open(s);
      await field(s, "beta").fill("2");
      await send(s).click();
      await s.shows("#model .steps [aria-current]", /Refused/, { advance: 2 });
      await s.shows("#model .order-status .note", /outside what the vehicle accepts/);
      assert.equal((await s.vehicle()).settings.in_force.beta, null);
      await s.page.getByRole("tab", { name: "Labels" }).click();
      await s.page.selectOption("#planner", "greedy");
      await s.page.locator("#send-planner").click();
      await s.until("the planner in force", async () => (await s.vehicle()).settings.in_force.planner === "greedy", { advance: 2 });
      await open(s);
      await s.shows("#model .steps [aria-current]", /Applied/);
      assert.equal(await s.page.locator("#model .replaced").isVisible(), false);
    },
  },
];
