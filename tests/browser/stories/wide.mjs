import assert from "node:assert/strict";

const LOAD_BYTES = 3e6;
const UPDATE_BYTES = 20000;
const UPDATE_MS = 50;
const FRAME_MS = 20;

/** Counts the bytes of responses on the wire, and lists the tiles that were requested. */
async function network(s) {
  const cdp = await s.devtools();
  await cdp.send("Network.enable");
  await cdp.send("Network.setCacheDisabled", { cacheDisabled: true });
  const found = { bytes: 0, mapBytes: 0, tiles: [] };
  const maps = new Set();
  cdp.on("Network.requestWillBeSent", ({ requestId, request }) => {
    if (!request.url.includes("/map/tiles")) return;
    maps.add(requestId);
    found.tiles.push(new URL(request.url).searchParams.get("since"));
  });
  cdp.on("Network.loadingFinished", ({ requestId, encodedDataLength }) => {
    found.bytes += encodedDataLength;
    if (maps.has(requestId)) found.mapBytes += encodedDataLength;
  });
  return found;
}

/** Whether the page's map equals the whole map of the server: tiles, levels and times. */
const isWhole = (s) =>
  s.inPage(async ({ store }) => {
    const [{ readTiles }, { TiledMap }] = await Promise.all([import("/js/api.js"), import("/js/tiles.js")]);
    const whole = new TiledMap(await readTiles(store.selectedId));
    const text = (map) => [...map.tiles].sort(([a], [b]) => a - b).map(([key, { parts }]) => [key, parts.map((p) => [p.x, p.y, p.width, [...p.levels], [...p.times], [...p.index]])]);
    return whole.version === store.map.version && JSON.stringify(text(whole)) === JSON.stringify(text(store.map));
  });

/** Advances the mission by an update of some hundred cells, and waits until the page has it. */
async function update(s) {
  const before = await s.inPage(({ store }) => store.map.version);
  await s.steer({ loss: 0, advance: 14 });
  await s.until("the update", () => s.inPage(({ store }, version) => store.map.version > version, before));
}

export default [
  {
    name: "a million cells in 20 km load in under 3 MB",
    long: true,
    scenario: "wide",
    async run(s) {
      const seen = await network(s);
      const before = await s.cpuMs();
      await s.page.reload();
      await s.ready();
      const ms = (await s.cpuMs()) - before;
      const { map } = await s.vehicle();
      assert.ok(map.explored_cells > 1e6 && map.width * 0.25 > 19990 && map.height * 0.25 > 19990, JSON.stringify(map));
      const cells = await s.inPage(({ store }) => {
        let count = 0;
        for (const tile of store.map.tiles.values()) tile.eachCell(() => (count += 1));
        return count;
      });
      assert.equal(cells, map.explored_cells);
      s.figures.push(`${cells} cells, ${Math.round(seen.bytes / 1000)} kB, ${Math.round(ms)} ms of CPU time`);
      assert.ok(seen.bytes > 10000 && seen.bytes < LOAD_BYTES, `${seen.bytes} bytes`);
    },
  },
  {
    name: "an update of a wide map brings only its own tiles",
    long: true,
    scenario: "wide",
    async run(s) {
      const seen = await network(s);
      await update(s);
      await s.inPage(({ store }) => (globalThis.held = store.map));
      const count = (await s.vehicle()).map.explored_cells;
      while ((await s.vehicle()).map.explored_cells < count + 500) await update(s);
      const cells = (await s.vehicle()).map.explored_cells - count;
      Object.assign(seen, { mapBytes: 0, tiles: [] });
      // The same update several times, since CPU time is measured in steps of 10 ms. The polling of a story would cost more.
      const times = 20;
      const before = await s.cpuMs();
      await s.inPage(async ({ store }, n) => {
        const { id, map } = store.vehicle;
        for (let i = 0; i < n; i += 1) {
          store.maps.set(id, globalThis.held);
          await store.fetchMap(id, map);
          for (let k = 0; k < 2; k += 1) await new Promise((resolve) => requestAnimationFrame(resolve));
        }
      }, times);
      const ms = ((await s.cpuMs()) - before) / times;
      await s.until("the last byte", () => seen.mapBytes > 0);
      s.within(UPDATE_MS, ms, `${cells} new cells: ${Math.round(seen.mapBytes / times)} bytes, ${Math.round(ms)} ms of CPU time`);
      assert.ok(seen.tiles.length === times && seen.tiles.every((since) => since), `${seen.tiles}`);
      assert.ok(seen.mapBytes / times < UPDATE_BYTES, `${seen.mapBytes / times} bytes`);
      assert.ok(await isWhole(s));
    },
  },
  {
    name: "a wide map is painted at both ends and pans smoothly",
    scenario: "wide",
    async run(s) {
      const painted = () => s.page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
      for (const [x, y] of [[-39000, -39997], [39900, 39996]]) {
        const [tint, shown] = await s.until("the colour of a far cell", async () => {
          const place = await s.inPage(({ store, view, redraw, shownAs, tintOf }, [cx, cy]) => {
            Object.assign(view, { mode: "free", scale: 40 });
            view.centre((cx + 0.5) * store.map.cell_m, (cy + 0.5) * store.map.cell_m);
            redraw();
            return { tint: tintOf(shownAs(store.map.label(cx, cy))), at: [view.width / 2, view.height / 2] };
          }, [x, y]);
          await painted();
          const pixel = await s.page.evaluate(([px, py]) => [...document.getElementById("chart").getContext("2d").getImageData(px, py, 1, 1).data].slice(0, 3), place.at.map(Math.round));
          return pixel.join() === place.tint.join() && [place.tint, pixel];
        });
        assert.deepEqual(shown, tint);
      }
      await s.inPage(({ fit }) => fit());
      await painted();
      const before = await s.cpuMs();
      await s.page.evaluate(async () => {
        const { view, redraw } = await import("/js/map/chart.js");
        for (let i = 0; i < 60; i += 1) {
          if (i === 30) Object.assign(view, { scale: 0.6 });
          view.panBy(i % 2 === 0 ? 3 : -3, 1);
          redraw();
          for (let k = 0; k < 2; k += 1) await new Promise((resolve) => requestAnimationFrame(resolve));
        }
      });
      const ms = ((await s.cpuMs()) - before) / 120;
      s.within(FRAME_MS, ms, `${ms.toFixed(1)} ms of CPU time a frame`);
    },
  },
  {
    name: "after a reconnection the page fetches what it has missed",
    scenario: "wide",
    async run(s) {
      const seen = await network(s);
      const before = await s.inPage(({ store }) => store.map.version);
      await s.steer({ stream: false });
      await s.until("the loss", () => s.page.evaluate(() => document.body.dataset.feed === "lost"));
      for (let i = 0; i < 3; i += 1) await s.steer({ loss: 0, advance: 14 });
      assert.equal(await s.inPage(({ store }) => store.map.version), before);
      await s.steer({ stream: true });
      await s.until("the missed updates", () => s.inPage(({ store }, version) => store.connected && store.map.version >= version + 3, before));
      assert.ok(seen.mapBytes > 0 && seen.mapBytes < 3 * UPDATE_BYTES, `${seen.mapBytes} bytes`);
      assert.ok(await isWhole(s));
    },
    tolerates: /503|ERR_/,
  },
  {
    name: "the map of another run replaces every tile",
    scenario: "wide",
    async run(s) {
      await s.steer({ scenario: "start", loss: 0, advance: 14 });
      await s.until("the new map", () => s.inPage(({ store }) => store.snapshot.mission.name === "start" && store.map.width < 1000), { advance: 14 });
      await s.until("the whole new map", () => isWhole(s));
    },
  },
];
