import assert from "node:assert/strict";

/** The centre of a cell of a large patch of one label, with the label. */
const inAPatch = (s) =>
  s.inPage(({ store }) => {
    const m = store.map;
    const isPatch = ({ x, y, label }) => [-3, 0, 3].every((dx) => [-3, 0, 3].every((dy) => m.label(x + dx, y + dy) === label));
    const cell = [...m.cells()].find(isPatch);
    return { label: cell.label, x: (cell.x + 0.5) * m.cell_m, y: (cell.y + 0.5) * m.cell_m, cell_m: m.cell_m };
  });

/** Has a place in the middle of the map, with cells of so many pixels, and returns the colours of the 9 x 9 pixels there. */
const colours = async (s, place, cellPx) => {
  await s.inPage(({ store, view: v, redraw, inWorld }, [at, px]) => {
    const [east, north] = inWorld(store.vehicle, at.x, at.y);
    Object.assign(v, { mode: "free", east, north, scale: px / at.cell_m });
    redraw();
  }, [place, cellPx]);
  await s.page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return s.inPage(({ view: v }) => {
    const data = document.getElementById("chart").getContext("2d").getImageData(Math.round(v.width / 2) - 4, Math.round(v.height / 2) - 4, 9, 9).data;
    return Array.from({ length: 81 }, (_, i) => [...data.slice(4 * i, 4 * i + 3)]);
  });
};

const meanOf = (tones) => [0, 1, 2].map((c) => tones.reduce((sum, tone) => sum + tone[c], 0) / tones.length);

/** The mean colour of the image of a label's row. */
const imageMean = (s, label) =>
  s.page.evaluate(async (selector) => {
    const image = document.querySelector(selector);
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), { width: image.naturalWidth, height: image.naturalHeight });
    const c = canvas.getContext("2d");
    c.drawImage(image, 0, 0);
    const { data } = c.getImageData(0, 0, canvas.width, canvas.height);
    return [0, 1, 2].map((n) => data.reduce((sum, v, i) => (i % 4 === n ? sum + v : sum), 0) / (data.length / 4));
  }, `.label[data-key='${label}'] .image img`);

const near = (a, b, by) => a.every((v, i) => Math.abs(v - b[i]) <= by);

export default [
  {
    name: "the natural layer shows each label as its images look, and L the colours again",
    scenario: "start",
    async run(s) {
      const place = await inAPatch(s);
      await s.page.selectOption("#layer", "natural");
      await s.shows("#legend", /illustration made of images.*no image yet/s);
      const own = await s.inPage(({ tintOf }, label) => tintOf(label), place.label);
      assert.ok(!near(meanOf(await colours(s, place, 4)), own, 20), "a label without an image is pale");
      await s.page.locator(`.label[data-key='${place.label}'] .request`).click();
      await s.until("an image", () => s.page.locator(`.label[data-key='${place.label}'] .image`).isVisible(), { advance: 20 });
      const mean = await imageMean(s, place.label);
      await s.until("the mean colour of the image", async () => near(meanOf(await colours(s, place, 4)), mean, 3));
      const texture = await colours(s, place, 20);
      assert.ok(new Set(texture.map(String)).size > 20, "a texture has many colours");
      assert.ok(near(meanOf(texture), mean, 60), `${meanOf(texture)} is far from ${mean}`);
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("l");
      assert.equal(await s.page.locator("#layer").inputValue(), "label");
      const isOwn = (tone) => near(tone, own, 1);
      await s.until("the colour of the label", async () => (await colours(s, place, 20)).filter(isOwn).length > 40);
    },
  },
  {
    name: "little confidence fades the natural layer",
    scenario: "start",
    async run(s) {
      await s.steer({ layers: true, advance: 30 });
      await s.page.selectOption("#layer", "natural");
      await s.until("faded cells", () =>
        s.inPage(async ({ store }) => {
          const { NaturalOver } = await import("/js/map/natural.js");
          const confidence = store.map?.layers.find((l) => l.name === "confidence");
          if (!confidence) return false;
          const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 64 });
          const tile = [...store.map.tiles.values()].find((t) => t.parts[confidence.number]);
          new NaturalOver(null).draw(canvas.getContext("2d"), store.vehicle, store.map, tile, [0, 0, 64]);
          const veil = canvas.getContext("2d").getImageData(0, 0, 64, 64).data;
          const alphas = [];
          tile.eachCell((x, y) => alphas.push([tile.parts[confidence.number].level(x, y), veil[4 * ((63 - y) * 64 + x) + 3]]));
          alphas.sort(([a], [b]) => a - b);
          return alphas.length > 1 && alphas[0][1] > alphas.at(-1)[1];
        }));
    },
  },
];
