import assert from "node:assert/strict";

const bits = (text) => text.replaceAll("\u202f", " ");

export default [
  {
    name: "the link shows rate, budget line, loss and bits by class",
    async run(s) {
      await s.shows("#link .direction", /worst \d+ s: \d+ % of budget/);
      const { link } = await s.get("/state");
      assert.equal(await s.page.locator("#budget").inputValue(), String(link.budget_bps));
      const rows = await s.page.locator(".classes tbody tr").allInnerTexts();
      assert.deepEqual(rows.map((r) => r.trim().split(/\s/)[0]), ["map", "confidence", "depth", "status", "directive", "fix", "exemplar", "overhead"]);
      const marked = await s.page.locator("#link canvas").evaluate((c) => {
        const { data } = c.getContext("2d").getImageData(0, 0, c.width, c.height);
        return data.some((v, i) => i % 4 === 3 && v > 0);
      });
      assert.ok(marked, "the history is drawn");
    },
  },
  {
    name: "a new budget is sent and its life line followed",
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
    name: "a budget out of range is refused in words",
    scenario: "rich",
    async run(s) {
      await s.page.locator("#budget").fill("7");
      await s.page.locator(".budget").getByRole("button", { name: "Set" }).click();
      await s.shows("#link .error", /budget_bps must be 100 to 100000/);
    },
    tolerates: /422/,
  },
  {
    name: "the backlog says when it will be empty",
    scenario: "rich",
    async run(s) {
      await s.until("a backlog", async () => (await s.get("/state")).link.backlog_bits > 0);
      const shown = async () => bits(await s.page.locator("#link .values").innerText());
      await s.until("its end", async () => /Backlog\s+\S+ k?bit, empty in/.test(await shown()));
    },
  },
];
