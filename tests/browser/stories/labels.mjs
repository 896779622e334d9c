import assert from "node:assert/strict";

const slider = (s, name) => s.page.getByRole("slider", { name: `Weight of ${name}`, exact: true });
const send = (s) => s.page.locator("#send-weights");
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

/** Requests an image of one label after the other until one has arrived; resolves to its button. The vehicle of a running mission may
 *  have no image of a label yet ("None yet"), and then the next label is tried. */
async function firstImage(s) {
  await firstLabels(s);
  const received = s.page.getByRole("button", { name: /^Image of .*, enlarge$/ }).first();
  const request = s.page.getByRole("button", { name: /^Request: an image of/ }).first();
  const requested = async () => (await s.page.locator(".exemplar .state").allInnerTexts()).some((text) => /Queued|On air|Receiving/.test(text));
  await s.until("an image", async () => {
    if (await received.isVisible()) return true;
    if ((await requested()) || !(await request.isVisible())) return false;
    const button = s.button(await request.getAttribute("aria-label"));
    await button.click();
    await s.until("the request in the state", async () => !(await button.isVisible()));
    return false;
  }, { ms: 300000, advance: 2 });
  const name = await received.getAttribute("aria-label");
  return s.page.getByRole("button", { name, exact: true });
}

export default [
  {
    name: "a dry run is shown until the weights change, and sends nothing",
    scenario: "rich",
    async run(s) {
      await firstLabels(s);
      await s.page.locator("#label-list input[type=range]").first().focus();
      await s.page.keyboard.press("ArrowRight");
      await s.page.locator("#try-weights").click();
      await s.shows(".dry-run", /Dry run, not sent.*would go to label/s);
      assert.ok(!s.posts.some((p) => p.path.endsWith("/utility")), "an order was sent");
      await s.page.locator("#label-list input[type=range]").first().focus();
      await s.page.keyboard.press("ArrowRight");
      await s.until("the dry run is gone", async () => !(await s.page.locator(".dry-run").isVisible()));
    },
  },
  {
    name: "the vehicle's panel tells what came of the weights",
    scenario: "rich",
    async run(s) {
      await firstLabels(s);
      assert.ok(!(await s.page.locator("#vehicle").innerText()).includes("Over favoured"), "no label is favoured");
      await s.steer({ favoured_time: { since_s: 10, share: 0.376, before: 0.09 } });
      await s.shows("#vehicle", /Over favoured.*38 % of the time, before the order 9 %/s);
      await s.steer({ favoured_time: { since_s: 10, share: 0.376, before: null } });
      await s.shows("#vehicle", /38 % of the time(?!, before)/);
    },
  },
  {
    name: "the page says why the vehicle goes to other floor than a favoured label",
    scenario: "rich",
    async run(s) {
      await firstLabels(s);
      const question = s.page.getByRole("button", { name: "Why not to a favoured label first?" });
      const aims = { legs: [], first: { reason: "unseen", label: null, at: [4, 0], along_m: 4, arrival_s: 60 }, targets: [] };
      await s.steer({ aims });
      assert.ok(!(await question.isVisible()), "no label is favoured");
      await s.page.locator("#label-list input[type=range]").first().focus();
      await s.page.keyboard.press("ArrowRight");
      await s.page.locator("#send-weights").click();
      await s.until("the weights are in force", () => question.isVisible(), { ms: 240000, advance: 2 });
      await question.click();
      await s.shows("#vehicle", /With these weights the vehicle would go to label/);
      await s.steer({ aims: { ...aims, first: { ...aims.first, reason: "label", label: 1 } } });
      await s.until("the question is gone", async () => !(await question.isVisible()));
    },
  },
  {
    name: "the first mission follows the state, and stays closed once it is closed",
    long: true,
    scenario: "rich",
    async run(s) {
      const card = ".first-mission summary";
      await s.shows(card, /step 2 of 5: name/);
      await s.inPage(({ rename }) => rename(1, "sand"));
      await s.shows(card, /step 3 of 5: weigh/);
      await s.page.locator("#label-list input[type=range]").first().focus();
      await s.page.keyboard.press("ArrowRight");
      await s.page.locator("#send-weights").click();
      await s.until("the order", () => s.posts.some((p) => p.path.endsWith("/utility")));
      await s.shows(card, /step [45] of 5/, { ms: 240000, advance: 2 });
      await s.page.locator(".exemplar .request").first().click();
      await s.shows(card, /all five steps are done/, { ms: 240000, advance: 2 });
      await s.page.getByRole("button", { name: "Close for good" }).click();
      await s.page.reload();
      await s.ready();
      assert.equal(await s.page.locator(".first-mission").count(), 0);
    },
  },
  {
    name: "the first mission names the label without an image, and another label can be requested",
    long: true,
    scenario: "rich",
    async run(s) {
      const picture = ".first-mission li:has(b:text-is('Picture'))";
      await s.steer({ loss: 0, without_image: [1] });
      await s.inPage(({ rename }) => rename(2, "sand"));
      await slider(s, "sand").fill("0.5");
      await send(s).click();
      await s.shows(picture, /Press Request beside a label/, { ms: 240000, advance: 2 });
      await s.button("Request: an image of Label 1").click();
      await s.shows(picture, /no new image of Label 1 yet.*Press Request beside another label/, { ms: 240000, advance: 2 });
      await s.button("Request: an image of sand").click();
      await s.shows(".first-mission summary", /all five steps are done/, { ms: 240000, advance: 2 });
    },
  },
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
    name: "weights are sent as a whole and the shown status is the server's",
    ends: true,
    async run(s) {
      const labels = await firstLabels(s);
      const before = (await s.vehicle()).directive.slots.find((x) => x.slot === "utility")?.version ?? 0;
      await slider(s, `Label ${labels[0].id}`).fill("0.8");
      assert.equal(await send(s).innerText(), "Send 1 change");
      // Each status with the text that the page shows for it: its own listener runs before this one.
      await s.inPage(({ store }, known) => {
        globalThis.statuses = [];
        store.on("state", () => {
          const slot = store.vehicle.directive.slots.find((x) => x.slot === "utility");
          const shown = document.querySelector("#send [aria-current=step]")?.textContent;
          if (slot?.version > known && slot.state !== globalThis.statuses.at(-1)?.[0]) globalThis.statuses.push([slot.state, shown]);
        });
      }, before);
      await send(s).click();
      const statuses = () => s.page.evaluate(() => globalThis.statuses);
      await s.until("the last status", async () => (await statuses()).at(-1)?.[0] === "applied", { ms: 240000, advance: 1 });
      const names = { queued: "Queued", on_air: "On air", received: "Received", applied: "Applied" };
      const seen = await statuses();
      for (const [state, shown] of seen) assert.equal(shown, names[state]);
      // A mission in real time may take several steps between two states.
      assert.ok(seen.length > 1 || !s.mocked, seen.join());
      const sent = s.posts.at(-1).body.weights;
      assert.equal(sent[labels[0].id], 0.8);
      assert.ok(labels.every((l) => String(l.id) in sent), "each label has its weight in the message");
    },
  },
  {
    name: "a weight stays a draft until it is sent, and can be discarded",
    async run(s) {
      const labels = await firstLabels(s);
      const before = s.posts.length;
      const row = slider(s, `Label ${labels[1].id}`);
      const was = await row.inputValue();
      await row.fill(Number(was) === 0.5 ? "0.6" : "0.5");
      await s.button("Discard weights edits").click();
      assert.equal(await row.inputValue(), was);
      assert.equal(await send(s).isDisabled(), true);
      assert.equal(s.posts.length, before);
    },
  },
  {
    name: "a weight that is not sent survives a reload and shows on the pages of others",
    scenario: "rich",
    async run(s) {
      const draft = async () => (await s.get("/state")).vehicles[0].draft;
      await slider(s, "Label 1").fill("0.4");
      await s.until("the draft at the surface", async () => (await draft()).weights[1] === 0.4);
      await s.page.reload();
      await s.ready();
      await s.until("the draft", async () => (await slider(s, "Label 1").inputValue()) === "0.4");
      assert.equal(await send(s).innerText(), "Send 1 change");
      await s.post("/vehicles/1/draft", { weights: { 2: -0.3 }, exploration: 0.5, author: "anna" });
      await s.until("the other draft", async () => (await slider(s, "Label 2").inputValue()) === "-0.3");
      assert.notEqual(await slider(s, "Label 1").inputValue(), "0.4");
      await s.until("two changes", async () => (await send(s).innerText()) === "Send 2 changes");
      await send(s).click();
      await s.until("no draft", async () => Object.keys((await draft()).weights).length === 0 && (await draft()).exploration === null);
    },
  },
  {
    name: "a refused order shows the reason and can be sent again",
    scenario: "refused",
    async run(s) {
      await s.shows("#send .order-status", /Refused.*label 3 was retired under epoch 1/s);
      assert.equal(await send(s).innerText(), "Send weights again");
      await send(s).click();
      await s.shows("#send .steps [aria-current]", /Applied/, { advance: 2 });
    },
  },
  {
    name: "the server's error message is shown",
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
    name: "an edit by another operator is a warning on a draft",
    scenario: "rich",
    async run(s) {
      await slider(s, "Label 1").fill("0.4");
      await s.post("/vehicles/1/utility", { weights: { 1: -0.5, 2: 0.7 }, exploration: 0.2 });
      await s.shows(".label[data-key='1'] .note", /Another console set it to −0.50 meanwhile/);
      assert.equal(await slider(s, "Label 1").inputValue(), "0.4");
      await s.until("the undrafted one to follow", async () => (await slider(s, "Label 2").inputValue()) === "0.7");
    },
  },
  {
    name: "an image of a label is requested, received and shown",
    ends: true,
    async run(s) {
      const image = await firstImage(s);
      await s.until("it to be drawn", () => image.locator("img").evaluate((img) => img.naturalWidth > 0));
      await image.click();
      await s.shows("#dialog", /received .* ago/);
    },
  },
  {
    name: "a row keeps its height while its image is requested and received",
    long: true,
    scenario: "rich",
    async run(s) {
      const row = s.page.locator(".label", { hasText: "Label 3" });
      const heights = new Map();
      const measure = async () => {
        const [state, hasImage, height] = await row.evaluate((node) => [node.querySelector(".exemplar .state").dataset.state, !node.querySelector(".image").hidden, node.getBoundingClientRect().height]);
        heights.set(`${state}${hasImage ? " beside an image" : ""}`, height);
        return state;
      };
      await s.steer({ loss: 0 });
      await measure();
      await row.locator(".request").click();
      await s.until("the image", async () => (await measure()) === "received", { advance: 2 });
      await row.locator(".image").click();
      await s.button("Another").click();
      await s.button("Close").click();
      await s.until("the request", async () => (await measure()) !== "received", { advance: 1 });
      await s.until("another image", async () => (await measure()) === "received", { advance: 2 });
      assert.ok(heights.has("receiving") && heights.has("receiving beside an image"), [...heights.keys()].join(", "));
      assert.equal(new Set(heights.values()).size, 1, JSON.stringify([...heights]));
    },
  },
  {
    name: "larger and further images arrive, and a request is cancelled",
    long: true,
    // In a rehearsal the vehicle may have no second image of the label.
    scenario: "rich",
    async run(s) {
      const image = await firstImage(s);
      await image.click();
      const dialog = s.page.locator("#dialog");
      await dialog.getByRole("button", { name: /^Larger/ }).click();
      await s.shows("#dialog", /128 px/, { ms: 300000, advance: 2 });
      await dialog.getByRole("button", { name: "Another" }).click();
      await s.until("two images", async () => (await dialog.locator("figure").count()) === 2, { ms: 300000, advance: 2 });
      await dialog.getByRole("button", { name: "Another" }).click();
      await dialog.getByRole("button", { name: "Cancel" }).click();
      await s.until("nothing under way", async () => !(await dialog.getByRole("button", { name: "Cancel" }).isVisible()));
      assert.equal(s.posts.at(-1).body.action, "cancel");
      assert.equal(await dialog.locator("figure").count(), 2);
      await s.page.reload();
      await s.ready();
      await s.until("the image after a reload", () => image.isVisible());
    },
  },
  {
    name: "a refused image is shown as refused",
    scenario: "rich",
    async run(s) {
      await s.steer({ refuse: "requests" });
      await s.page.getByRole("button", { name: "Request: an image of Label 2" }).click();
      await s.shows(".label[data-key='2'] .exemplar", /Request again\s+Refused/, { advance: 2 });
    },
  },
  {
    name: "names, colours and merges survive a reload",
    async run(s) {
      const [a, b] = await firstLabels(s);
      const orders = () => s.posts.filter((p) => !p.path.endsWith("/labels"));
      const before = orders().length;
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
      assert.equal(orders().length, before, "names stay at the surface");
      await send(s).click();
      await s.until("the message", () => orders().length > before);
      assert.equal(orders().at(-1).body.weights[b.id], 0.35, "the merged label takes the weight");
    },
  },
  {
    name: "fewer labels are shown by the slider, and a weight of a group is sent for each label in it",
    scenario: "rich",
    async run(s) {
      const rows = () => s.page.locator(".label").count();
      const { labels, label_tree } = await s.vehicle();
      const [into, joins] = label_tree.merges[0];
      const own = labels.find((l) => l.id === joins).weight;
      await s.until("all labels", async () => (await rows()) === labels.length);
      await s.shows(".cut .value", new RegExp(`${labels.length} of ${labels.length}`));
      await s.page.locator("#label-cut").fill(String(labels.length - 1));
      await s.until("one label fewer", async () => (await rows()) === labels.length - 1);
      await s.shows(`.label[data-key='${into}'] .name`, /\+1/);
      const group = labels.filter((l) => [into, joins].includes(l.id)).reduce((sum, l) => sum + l.area_m2, 0);
      const shown = await s.page.locator(`.label[data-key='${into}'] .area`).innerText();
      assert.equal(parseFloat(shown.replaceAll("\u202f", "")).toFixed(1), group.toFixed(1));
      const posts = () => s.posts.filter((p) => p.path.endsWith("/utility"));
      await s.page.locator("#exploration").fill("0.45");
      await send(s).click();
      await s.until("the message", () => posts().length === 1);
      assert.equal(posts()[0].body.weights[joins], own, "a label keeps its weight until its group is given one");
      await slider(s, `Label ${into}`).fill("0.35");
      await send(s).click();
      await s.until("the second message", () => posts().length === 2);
      assert.deepEqual([into, joins].map((id) => posts()[1].body.weights[id]), [0.35, 0.35]);
      await s.page.reload();
      await s.ready();
      await s.until("the cut after a reload", async () => (await rows()) === labels.length - 1);
      await s.inPage(({ rename }, id) => rename(id, "kelp"), joins);
      await s.shows(`.label[data-key='${into}'] .name`, /kelp \+1/);
      await s.inPage(({ rename }, id) => rename(id, ""), joins);
      await s.page.locator("#label-cut").fill(String(labels.length));
      await s.until("all labels again", async () => (await rows()) === labels.length);
    },
  },
  {
    name: "weights of unexplored and surprising cells are sent too",
    ends: true,
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
    name: "a label shows what the last five minutes brought",
    scenario: "rich",
    async run(s) {
      const labels = (await s.vehicle()).labels.filter((l) => Math.abs(l.gained_m2) >= 1);
      const gains = await s.page.locator(".label .gain:visible").allInnerTexts();
      assert.ok(gains.length > 0 && labels.length > 0);
      assert.equal(gains.some((gain) => gain.startsWith("+")), labels.some((l) => l.gained_m2 > 0));
      assert.equal(gains.some((gain) => gain.startsWith("\u2212")), labels.some((l) => l.gained_m2 < 0));
    },
  },
  {
    name: "the planner is chosen and set",
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
    name: "the end of the survey is chosen and set without another choice of the planner",
    long: true,
    ends: true,
    async run(s) {
      await s.page.selectOption("#at-end", "hold");
      await s.page.locator("#send-planner").click();
      await s.until("the message", () => s.posts.some((p) => p.path.endsWith("/settings")));
      assert.deepEqual(s.posts.at(-1).body, { at_end: "hold" });
      await s.until("the choice in force", async () => (await s.vehicle()).settings.in_force.at_end === "hold", { advance: 2 });
      assert.equal(await s.page.locator("#at-end").inputValue(), "hold");
    },
  },
  {
    name: "weights of another console after ours are marked",
    scenario: "rich",
    async run(s) {
      await slider(s, "Label 1").fill("0.4");
      await send(s).click();
      await s.until("its version", async () => (await s.vehicle()).directive.slots.some((x) => x.slot === "utility" && x.version === 1));
      await s.post("/vehicles/1/utility", { weights: { 1: -0.5 }, exploration: 0.2 });
      await s.shows("#send .replaced", /Changed by another console \(version 2\)/);
      await s.page.getByRole("button", { name: "OK: Weights changed by another console" }).click();
      assert.equal(await s.page.locator("#send .replaced").isVisible(), false);
      await s.page.locator("#exploration").fill("0.6");
      await s.post("/vehicles/1/utility", { weights: { 1: -0.5 }, exploration: -0.3 });
      await s.shows("#send .replaced", /Changed by another console meanwhile/);
      await s.button("Discard weights edits").click();
      await s.until("their value", async () => (await s.page.locator("#exploration").inputValue()) === "-0.3");
    },
  },
  {
    name: "one label can be shown alone",
    async run(s) {
      const [first] = await firstLabels(s);
      // By its key: the surface keeps the names that an earlier story has given.
      const chip = s.page.locator(`.label[data-key='${first.id}']`).getByRole("button", { name: /^Show only .* on the map$/ });
      await chip.click();
      assert.equal(await s.inPage(({ layer }) => layer.highlight), first.id);
      await chip.click();
      assert.equal(await s.inPage(({ layer }) => layer.highlight), null);
    },
  },
];
