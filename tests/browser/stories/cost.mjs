import assert from "node:assert/strict";

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
      await s.page.reload();
      await s.ready();
      const ms = await s.page.evaluate(() => performance.getEntriesByName("scenecast-ready")[0]?.startTime);
      assert.ok(ms < 1000, `ready after ${ms} ms`);
      assert.ok(bytes > 10000 && bytes < 400000, `${bytes} bytes`);
    },
  },
  {
    name: "a map of more than 512 by 512 cells pans smoothly",
    scenario: "big",
    async run(s) {
      const times = await s.page.evaluate(async () => {
        const { view, redraw } = await import("/js/map/chart.js");
        const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
        const spent = [];
        for (let i = 0; i < 60; i += 1) {
          view.panBy(3, 1);
          const start = performance.now();
          redraw();
          await frame();
          await frame();
          spent.push((performance.now() - start) / 2);
        }
        return spent.sort((a, b) => a - b);
      });
      const median = times[Math.floor(times.length / 2)];
      assert.ok(median < 20, `${median} ms a frame`);
    },
  },
  {
    name: "a long session neither leaks nor slows",
    scenario: "rich",
    async run(s) {
      const cdp = await s.context.newCDPSession(s.page);
      const measure = async () => {
        await cdp.send("HeapProfiler.collectGarbage");
        const { nodes, jsEventListeners } = await cdp.send("Memory.getDOMCounters");
        const { usedSize } = await cdp.send("Runtime.getHeapUsage");
        return { nodes, jsEventListeners, usedSize };
      };
      const hours = async (n) => {
        for (let i = 0; i < n; i += 1) {
          await s.steer({ advance: 60 });
          await new Promise((resolve) => setTimeout(resolve, 25));
        }
      };
      await hours(60);
      const first = await measure();
      await hours(120);
      const last = await measure();
      assert.ok(last.nodes < first.nodes * 1.2 + 100, `${first.nodes} -> ${last.nodes} nodes`);
      assert.ok(last.jsEventListeners < first.jsEventListeners * 1.2 + 20, `${first.jsEventListeners} -> ${last.jsEventListeners} listeners`);
      assert.ok(last.usedSize < first.usedSize * 1.5 + 2e6, `${first.usedSize} -> ${last.usedSize} bytes`);
    },
  },
];
