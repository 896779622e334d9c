import assert from "node:assert/strict";

const ENTRIES = [
  { kind: "order", by: "ann", vehicle: 1, text: "weights: label 3 +0.80" },
  { kind: "answer", vehicle: 1, text: "utility version 1 applied" },
  { kind: "contact", vehicle: 1, text: "silent for 2 min 5 s" },
];

const rows = (s) => s.page.locator("#log .log li").allInnerTexts();

export default [
  {
    name: "the log names each order with its author, the newest first, and is filtered by kind and by words",
    scenario: "start",
    async run(s) {
      await s.page.getByRole("tab", { name: "Log" }).click();
      await s.shows("#log", /will appear here/);
      await s.steer({ log: ENTRIES });
      await s.until("the entries", async () => (await rows(s)).length === 3, { advance: 1 });
      const [newest, , oldest] = await rows(s);
      assert.match(newest, /T\+.*auv-1.*silent for 2 min/s);
      assert.match(oldest, /ann.*weights: label 3/s);
      await s.page.getByLabel("Kind of the entries").selectOption("answer");
      assert.deepEqual((await rows(s)).map((r) => /applied/.test(r)), [true]);
      assert.match(await s.page.getByText("Download as CSV").getAttribute("href"), /log\.csv\?kind=answer$/);
      await s.page.getByLabel("Kind of the entries").selectOption("");
      await s.page.getByLabel("Text of the entries").fill("ANN");
      assert.deepEqual((await rows(s)).map((r) => /ann/.test(r)), [true]);
      await s.page.getByLabel("Text of the entries").fill("no such word");
      await s.shows("#log", /No entry is like that/);
      await s.page.getByLabel("Text of the entries").fill("");
      await s.steer({ log: [{ kind: "mode", vehicle: 1, text: "holding: order" }] });
      await s.until("the new entry", async () => (await rows(s)).length === 4, { advance: 1 });
      assert.match((await rows(s))[0], /holding: order/);
    },
  },
];
