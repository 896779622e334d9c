import assert from "node:assert/strict";

const SMOOTH_MS = 20;
const PAINTED_MS = 200;
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

export default [
  {
    name: "the page is usable within a second and under 400 kB",
    bare: true,
    async run(s) {
      const cdp = await s.context.newCDPSession(s.page);
      await cdp.send("Network.enable");
      await cdp.send("Network.setCacheDisabled", { cacheDisabled: true });
      const kinds = new Map();
      let bytes = 0;
      cdp.on("Network.responseReceived", ({ requestId, type }) => kinds.set(requestId, type));
      cdp.on("Network.loadingFinished", (e) => {
        if (["Document", "Script", "Stylesheet", "Image", "Other"].includes(kinds.get(e.requestId))) bytes += e.encodedDataLength;
      });
      const [ms] = await s.best((t) => t < 1000, async () => {
        bytes = 0;
        await s.page.reload();
        await s.ready();
        return s.page.evaluate(() => performance.getEntriesByName("scenecast-ready")[0].startTime);
      });
      s.figures.push(`usable after ${Math.round(ms)} ms`, `${Math.round(bytes / 1000)} kB`);
      assert.ok(ms < 1000, `ready after ${ms} ms`);
      assert.ok(bytes > 10000 && bytes < 400000, `${bytes} bytes`);
    },
  },
  {
    name: "a map of more than 512 by 512 cells pans smoothly",
    scenario: "big",
    async run(s) {
      const [ms] = await s.best((t) => t < SMOOTH_MS, async () => median(await s.page.evaluate(async () => {
        const { view, redraw } = await import("/js/map/chart.js");
        const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
        const spent = [];
        for (let i = 0; i < 60; i += 1) {
          view.panBy(i < 30 ? 3 : -3, 1);
          const start = performance.now();
          redraw();
          await frame();
          await frame();
          spent.push((performance.now() - start) / 2);
        }
        return spent;
      })));
      s.figures.push(`${ms.toFixed(1)} ms a frame`);
      assert.ok(ms < SMOOTH_MS, `${ms} ms a frame`);
    },
  },
  {
    name: "a map update is painted within 200 ms of its arrival at the surface",
    unmocked: true,
    async run(s) {
      await s.post("/vehicles/1/constraints", { hold: false });
      const late = () => s.page.evaluate(async () => {
        const { store } = await import("/js/store.js");
        const wanted = 15;
        // The mission's clock against ours: no state comes before it was made, so the quickest one tells best.
        let clock = Infinity;
        const seen = new Map();
        const { speed } = store.snapshot.mission;
        const source = new EventSource("/api/v1/events");
        source.addEventListener("state", (event) => {
          const at = performance.now();
          const state = JSON.parse(event.data);
          clock = Math.min(clock, at - (1000 * state.now_s) / speed);
          const { version, updated_s } = state.vehicles[0].map;
          if (!seen.has(version)) seen.set(version, updated_s);
        });
        const painted = [];
        let shown = store.map?.version ?? 0;
        while (painted.length < wanted) {
          await new Promise((resolve) => store.addEventListener("map", resolve, { once: true }));
          await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
          const { version } = store.map;
          if (version > shown && seen.has(version)) painted.push([performance.now(), seen.get(version)]);
          shown = version;
        }
        source.close();
        return painted.map(([at, updated]) => at - clock - (1000 * updated) / speed);
      });
      const [ms] = await s.best((t) => t < PAINTED_MS, async () => median(await late()));
      s.figures.push(`median ${Math.round(ms)} ms from arrival to paint`);
      assert.ok(ms < PAINTED_MS, `${ms} ms`);
    },
  },
  {
    name: "a session of hours and thousands of events neither leaks nor slows",
    scenario: "rich",
    async run(s) {
      const cdp = await s.context.newCDPSession(s.page);
      let events = 0;
      const go = async (batches) => {
        for (let i = 0; i < batches; i += 1) {
          const { now_s } = await s.steer({ advance: 15, times: 50 });
          events += 100;
          await s.until("the last state", () => s.inPage(({ store }, now) => store.snapshot.now_s >= now, now_s));
        }
      };
      /** Milliseconds for the page to take a state and to paint it. */
      const taking = () => s.inPage(async ({ store }) => {
        const spent = [];
        for (let i = 0; i < 40; i += 1) {
          const start = performance.now();
          store.take(structuredClone(store.snapshot));
          spent.push(performance.now() - start);
          await new Promise((resolve) => requestAnimationFrame(resolve));
        }
        return spent.toSorted((a, b) => a - b)[20];
      });
      const measure = async () => {
        await cdp.send("HeapProfiler.collectGarbage");
        const { nodes, jsEventListeners } = await cdp.send("Memory.getDOMCounters");
        const { usedSize } = await cdp.send("Runtime.getHeapUsage");
        return { nodes, jsEventListeners, usedSize, takeMs: await taking() };
      };
      // Track, history and map are full by then.
      await go(10);
      const first = await measure();
      await go(30);
      const last = await measure();
      const { now_s } = await s.get("/state");
      const mb = (n) => (n / 1e6).toFixed(1);
      s.figures.push(`${events} events, ${(now_s / 3600).toFixed(1)} h`, `heap ${mb(first.usedSize)} to ${mb(last.usedSize)} MB`,
        `${first.nodes} to ${last.nodes} nodes`, `a state takes ${first.takeMs.toFixed(1)} to ${last.takeMs.toFixed(1)} ms`);
      assert.ok(last.nodes < first.nodes * 1.1 + 100, `${first.nodes} -> ${last.nodes} nodes`);
      assert.ok(last.jsEventListeners < first.jsEventListeners * 1.1 + 20, `${first.jsEventListeners} -> ${last.jsEventListeners} listeners`);
      assert.ok(last.usedSize < first.usedSize * 1.2 + 1e6, `${first.usedSize} -> ${last.usedSize} bytes`);
      const [again] = await s.best((t) => t < first.takeMs * 1.5 + 4, taking);
      assert.ok(again < first.takeMs * 1.5 + 4, `a state takes ${first.takeMs} -> ${again} ms`);
    },
  },
];
