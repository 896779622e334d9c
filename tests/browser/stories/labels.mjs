import assert from "node:assert/strict";

const slider = (s, name) => s.page.getByRole("slider", { name: `Weight of ${name}`, exact: true });
const send = (s) => s.page.locator("#send-weights");
const step = (s) => s.page.locator("#send [aria-current=step]").innerText({ timeout: 300 }).catch(() => null);
const labelButton = (s, name) => s.page.locator(".label .name", { hasText: name }).first();

async function firstLabels(s) {
  await s.until("labels", async () => (await s.page.locator(".label").count()) > 1, { ms: 60000, advance: 10 });
  const { labels } = await s.vehicle();
  return labels;
}

async function edit(s, name, fill) {
  await labelButton(s, name).click();
  await fill(s.page.locator("#dialog"));
  await s.button("Save").click();
}

/** Asks for a picture of the first label without one; its button once it is there. */
async function firstPicture(s) {
  await firstLabels(s);
  const ask = s.page.getByRole("button", { name: /^Show me: a picture of/ }).first();
  const name = (await ask.getAttribute("aria-label")).replace(/^.*picture of /, "");
  await ask.click();
  const picture = s.page.getByRole("button", { name: `Picture of ${name}, enlarge` });
  await s.until("the picture", () => picture.isVisible(), { ms: 300000, advance: 2 });
  return picture;
}

export default [
  {
    name: "the list shows every label with its area",
    async run(s) {
      const labels = await firstLabels(s);
      await s.until("one row a label", async () => (await s.page.locator(".label").count()) >= labels.length);
      await s.until("the areas", async () => {
        const { labels: now } = await s.vehicle();
        const shown = await s.page.locator(".label .area").allInnerTexts();
        return parseFloat(shown[0].replaceAll("\u202f", "")).toFixed(1) === now[0].area_m2.toFixed(1);
      });
    },
  },
  {
    name: "the list can be ordered by area",
    async run(s) {
      await firstLabels(s);
      await s.page.selectOption("#label-order", "area");
      const areas = (await s.page.locator(".label .area").allInnerTexts()).map((t) => parseFloat(t.replaceAll("\u202f", "")));
      assert.deepEqual(areas, [...areas].sort((a, b) => b - a));
    },
  },
  {
    name: "weights are sent as a whole and the life line follows the server, never ahead of it",
    async run(s) {
      const labels = await firstLabels(s);
      const before = (await s.vehicle()).directive.slots.find((x) => x.slot === "utility")?.version ?? 0;
      await slider(s, `Label ${labels[0].id}`).fill("0.8");
      assert.equal(await send(s).innerText(), "Send 1 change");
      await send(s).click();
      const seen = [];
      await s.until("the life line to end", async () => {
        const word = await step(s);
        if (word && word !== seen.at(-1)) seen.push(word);
        const slot = (await s.vehicle()).directive.slots.find((x) => x.slot === "utility");
        return slot?.version > before && word === "Applied";
      }, { ms: 240000, advance: 1 });
      const order = ["Queued", "On air", "Heard", "Applied"];
      const lives = seen.slice(seen[0] === "Applied" ? 1 : 0).map((w) => order.indexOf(w));
      assert.ok(lives.length > 1 && lives.at(-1) === 3, seen.join());
      const sent = s.posts.at(-1).body.weights;
      assert.equal(sent[labels[0].id], 0.8);
      assert.ok(labels.every((l) => String(l.id) in sent), "each label has its weight in the message");
    },
  },
  {
    name: "a weight stays a draft until it is sent, and can be taken back",
    async run(s) {
      const labels = await firstLabels(s);
      const before = s.posts.length;
      const row = slider(s, `Label ${labels[1].id}`);
      const was = await row.inputValue();
      await row.fill(Number(was) === 0.5 ? "0.6" : "0.5");
      await s.button("Discard").click();
      assert.equal(await row.inputValue(), was);
      assert.equal(await send(s).isDisabled(), true);
      assert.equal(s.posts.length, before);
    },
  },
  {
    name: "a refusal is shown with its reason and can be sent again",
    scenario: "refused",
    async run(s) {
      await s.shows("#send .lifeline", /Refused.*label 3 was retired under epoch 1/s);
      assert.equal(await send(s).innerText(), "Send again");
      await send(s).click();
      await s.shows("#send .steps [aria-current]", /Applied/, { advance: 2 });
    },
  },
  {
    name: "bad input refused by the server is shown in its words",
    scenario: "rich",
    async run(s) {
      await s.page.route("**/utility", (route) => route.fulfill({ status: 422, contentType: "application/json", body: '{"error":"weight of label 1 must be -1 to 1"}' }));
      await slider(s, "Label 1").fill("0.4");
      await send(s).click();
      await s.shows("#send .error", /weight of label 1 must be -1 to 1/);
      assert.equal(await send(s).innerText(), "Send 1 change");
    },
    tolerates: /422/,
  },
  {
    name: "an edit by another operator shows, on a draft as a warning",
    scenario: "rich",
    async run(s) {
      await slider(s, "Label 1").fill("0.4");
      await s.post("/vehicles/1/utility", { weights: { 1: -0.5, 2: 0.7 }, exploration: 0.2 });
      await s.shows(".label[data-key='1'] .note", /Set to −0.50 elsewhere/);
      assert.equal(await slider(s, "Label 1").inputValue(), "0.4");
      await s.until("the undrafted one to follow", async () => (await slider(s, "Label 2").inputValue()) === "0.7");
    },
  },
  {
    name: "a picture of a label is asked for, comes with progress, and is shown",
    async run(s) {
      const picture = await firstPicture(s);
      await s.until("it to be drawn", () => picture.locator("img").evaluate((img) => img.naturalWidth > 0));
      await picture.click();
      await s.shows("#dialog", /received .* ago/);
    },
  },
  {
    name: "a picture grows, another one comes beside it, and what is cancelled goes no further",
    // A rehearsal may have no second picture of the label to show.
    scenario: "rich",
    async run(s) {
      const picture = await firstPicture(s);
      await picture.click();
      const dialog = s.page.locator("#dialog");
      await dialog.getByRole("button", { name: /^Larger/ }).click();
      await s.shows("#dialog", /128 px/, { ms: 300000, advance: 2 });
      await dialog.getByRole("button", { name: "Another" }).click();
      await s.until("two pictures", async () => (await dialog.locator("figure").count()) === 2, { ms: 300000, advance: 2 });
      await dialog.getByRole("button", { name: "Another" }).click();
      await dialog.getByRole("button", { name: "Cancel" }).click();
      await s.until("nothing under way", async () => !(await dialog.getByRole("button", { name: "Cancel" }).isVisible()));
      assert.equal(s.posts.at(-1).body.what, "cancel");
      assert.equal(await dialog.locator("figure").count(), 2);
      await s.page.reload();
      await s.ready();
      await s.until("the picture after a reload", () => picture.isVisible());
    },
  },
  {
    name: "a picture that the vehicle refuses says so",
    scenario: "rich",
    async run(s) {
      await s.steer({ refuse: "requests" });
      await s.page.getByRole("button", { name: "Show me: a picture of Label 2" }).click();
      await s.shows(".label[data-key='2'] .exemplar", /Ask again\s+Refused/, { advance: 2 });
    },
  },
  {
    name: "names, colours and merges stay in the browser and survive a reload",
    async run(s) {
      const [a, b] = await firstLabels(s);
      const before = s.posts.length;
      await edit(s, `Label ${a.id}`, async (d) => {
        await d.getByLabel("Name").fill("Soft coral");
        await d.getByLabel("Colour").fill("#123456");
      });
      await edit(s, `Label ${b.id}`, (d) => d.getByLabel("Show as part of").selectOption({ label: "Soft coral" }));
      await s.page.reload();
      await s.ready();
      await s.shows(`.label[data-key='${a.id}'] .name`, /Soft coral \+1/);
      assert.equal(await s.page.locator(`.label[data-key='${b.id}']`).count(), 0);
      assert.equal(await s.page.locator(`.label[data-key='${a.id}'] .chip`).evaluate((c) => getComputedStyle(c).backgroundColor), "rgb(18, 52, 86)");
      await slider(s, "Soft coral").fill("0.35");
      assert.equal(s.posts.length, before);
      await send(s).click();
      await s.until("the message", () => s.posts.length > before);
      assert.equal(s.posts.at(-1).body.weights[b.id], 0.35, "the merged label takes the weight");
    },
  },
  {
    name: "weights of unexplored and puzzling ground go with those of the labels",
    async run(s) {
      await firstLabels(s);
      await s.page.locator("#exploration").fill("0.45");
      await s.page.locator("#curiosity").fill("0.3");
      assert.equal(await send(s).innerText(), "Send 2 changes");
      await send(s).click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/utility")));
      const { exploration, curiosity } = s.posts.at(-1).body;
      assert.deepEqual([exploration, curiosity], [0.45, 0.3]);
      await s.until("the server's values", async () => {
        const { utility } = await s.vehicle();
        return utility.exploration === 0.45 && utility.curiosity === 0.3;
      });
      await s.until("no draft left", async () => (await send(s).innerText()) !== "Send 2 changes");
      assert.equal(await s.page.locator("#curiosity").inputValue(), "0.3");
    },
  },
  {
    name: "the planner is chosen, set and followed",
    async run(s) {
      await s.page.selectOption("#planner", "greedy");
      await s.page.locator("#send-planner").click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/settings")));
      assert.deepEqual(s.posts.at(-1).body, { planner: "greedy" });
      await s.shows(".planner .note", /applied/, { ms: 240000, advance: 2 });
      assert.equal((await s.vehicle()).planner, "greedy");
    },
  },
  {
    name: "weights that another console sent after ours are said to be theirs",
    scenario: "rich",
    async run(s) {
      await slider(s, "Label 1").fill("0.4");
      await send(s).click();
      await s.until("its version", async () => (await s.vehicle()).directive.slots.some((x) => x.slot === "utility" && x.version === 1));
      await s.post("/vehicles/1/utility", { weights: { 1: -0.5 }, exploration: 0.2 });
      await s.shows("#send .others", /Changed by another console \(version 2\)/);
      await s.page.getByRole("button", { name: "OK: Weights changed by another console" }).click();
      assert.equal(await s.page.locator("#send .others").isVisible(), false);
      await s.page.locator("#exploration").fill("0.6");
      await s.post("/vehicles/1/utility", { weights: { 1: -0.5 }, exploration: -0.3 });
      await s.shows("#send .others", /changed by another console meanwhile/);
      await s.button("Discard").click();
      assert.equal(await s.page.locator("#exploration").inputValue(), "-0.3");
    },
  },
  {
    name: "one label can be shown alone",
    async run(s) {
      const [first] = await firstLabels(s);
      const chip = s.page.getByRole("button", { name: `Show only Label ${first.id} on the map` });
      await chip.click();
      assert.equal(await s.inPage(({ layer }) => layer.highlight), first.id);
      await chip.click();
      assert.equal(await s.inPage(({ layer }) => layer.highlight), null);
    },
  },
];
