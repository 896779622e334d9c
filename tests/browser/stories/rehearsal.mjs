// The true classes of a simulated sea floor.

import assert from "node:assert/strict";

/** Shows the northern edge of the mock's sea floor. */
const lookAtEdge = (s) =>
  s.page.evaluate(async () => {
    const { view, redraw } = await import("/js/map/chart.js");
    Object.assign(view, { mode: "free", east: 0, north: 12, scale: 10 });
    redraw();
  });

/** The colour of the map at a place in metres, after the next frame has been painted. */
const toneAt = (s, x, y) =>
  s.inPage(async ({ view }, place) => {
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const [px, py] = view.toScreen(...place).map(Math.round);
    return [...document.getElementById("chart").getContext("2d").getImageData(px, py, 1, 1).data].slice(0, 3);
  }, [x, y]);

export default [
  {
    name: "T shows the true sea floor of a rehearsal, and the layer before it again",
    scenario: "start",
    async run(s) {
      const names = () => s.page.locator("#layer option").allInnerTexts();
      assert.ok(!(await names()).includes("truth"), "without a simulated sea floor there is no truth");
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("t");
      assert.equal(await s.page.locator("#layer").inputValue(), "label");
      await s.steer({ truth: true, advance: 2 });
      await s.until("the layer truth", async () => (await names()).includes("truth"));
      await s.page.selectOption("#layer", "age");
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("t");
      await s.shows("#legend", /true sea floor.*sand.*seagrass/s);
      await lookAtEdge(s);
      const tone = (x, y) => toneAt(s, x, y);
      await s.until("sand in the west", async () => (await tone(-18.3, 13.2)).join() === "230,159,0", { advance: 1 });
      await s.until("seagrass in the east", async () => (await tone(18.3, 13.2)).join() === "86,180,233");
      assert.notEqual((await tone(18.3, 16.2)).join(), "86,180,233", "north of the picture");
      await s.page.keyboard.press("t");
      await s.shows("#legend", /age of cells/);
      await s.until("the map again", async () => (await tone(-18.3, 13.2)).join() !== "230,159,0");
    },
  },
  {
    name: "the true sea floor is painted in shades of red in the red theme",
    theme: "red",
    scenario: "start",
    async run(s) {
      await s.steer({ truth: true, advance: 2 });
      await s.until("the layer truth", async () => (await s.page.locator("#layer option").allInnerTexts()).includes("truth"));
      await s.page.selectOption("#layer", "truth");
      await lookAtEdge(s);
      const tones = async () => [await toneAt(s, -18.3, 13.2), await toneAt(s, 18.3, 13.2)];
      const isRed = ([r, g, b]) => r > 60 && g <= 50 && b <= 50;
      await s.until("two shades of red", async () => {
        const [sand, seagrass] = await tones();
        return isRed(sand) && isRed(seagrass) && sand.join() !== seagrass.join();
      });
      const chips = await s.page.locator(".truth-chip").evaluateAll((all) => all.map((chip) => chip.style.background));
      assert.deepEqual(chips.map((colour) => colour.match(/\d+/g).join()), (await tones()).map((tone) => tone.join()));
    },
  },
];
