import assert from "node:assert/strict";
import { PHONE } from "../stage.mjs";
import { LAYERS } from "../mock/vehicle.mjs";

const view = (s) => s.inPage(({ view: v }) => ({ east: v.east, north: v.north, scale: v.scale, mode: v.mode, width: v.width, height: v.height }));

/** A cell of the map with its place on the screen, near the middle of what is explored. */
async function someCell(s) {
  return s.inPage(({ store, view: v, inWorld, shownAs, tintOf }) => {
    const m = store.map;
    const box = document.getElementById("chart").getBoundingClientRect();
    const status = store.vehicle.status ?? { x_m: 0, y_m: 0 };
    for (const cell of m.cells()) {
      const x = (cell.x + 0.5) * m.cell_m;
      const y = (cell.y + 0.5) * m.cell_m;
      const path = [status.waypoint ?? [status.x_m, status.y_m], ...(status.path ?? [])];
      const onPath = path.some(([bx, by], k) => {
        const [ax, ay] = k === 0 ? [status.x_m, status.y_m] : path[k - 1];
        const along = Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2 || 1)));
        return Math.hypot(ax + along * (bx - ax) - x, ay + along * (by - ay) - y) < 0.6;
      });
      const near = onPath || store.vehicle.track.some(([, tx, ty]) => Math.hypot(tx - x, ty - y) < 0.2);
      const [px, py] = v.toScreen(...inWorld(store.vehicle, x, y));
      const inside = px > 120 && py > 90 && px < v.width - 120 && py < v.height - 90;
      if (!inside || near || Math.hypot(status.x_m - x, status.y_m - y) < 3) continue;
      return { label: cell.label, tint: tintOf(shownAs(cell.label)), x, y, px, py, left: box.left, top: box.top };
    }
    return null;
  });
}

/** Resolves after the next frame, in which the page paints its changes. */
const painted = (s) => s.page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

const pixel = async (s, px, py) => {
  await painted(s);
  return s.page.evaluate(([x, y]) => [...document.getElementById("chart").getContext("2d").getImageData(x, y, 1, 1).data].slice(0, 3), [Math.round(px), Math.round(py)]);
};

/** The result of `check` for waypoint and path. */
const plan = (s, check, argument) =>
  s.inPage(`({ store }, before) => {
    const { waypoint, path } = store.vehicle.status ?? {};
    return (${check})({ drawn: Boolean(path?.length), at: JSON.stringify([waypoint, path]) }, before);
  }`, argument);

/** Share of the longest leg of the path that has an ink of the map. */
const onLeg = (s, tone) =>
  s.inPage(({ store, view: v, inWorld, ink }, name) => {
    const { waypoint, path } = store.vehicle.status;
    const corners = [waypoint, ...path].map((p) => v.toScreen(...inWorld(store.vehicle, ...p)));
    const legs = corners.slice(1).map((to, i) => [corners[i], to, Math.hypot(to[0] - corners[i][0], to[1] - corners[i][1])]);
    const [from, to, length] = legs.reduce((a, b) => (b[2] > a[2] ? b : a));
    const wanted = ink(`--map-${name}`);
    const c = document.getElementById("chart").getContext("2d");
    const is = (x, y) => wanted.every((w, n) => Math.abs(w - c.getImageData(x, y, 1, 1).data[n]) < 40);
    // Past the cross at one end and the dot at the other.
    const [begin, end] = [10 / length, 1 - 6 / length];
    const places = Array.from({ length: 100 }, (_, i) => begin + ((end - begin) * i) / 99).map((t) => [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]);
    return places.filter(([x, y]) => [-1, 0].some((d) => is(x + d, y) || is(x, y + d))).length / places.length;
  }, tone);

async function pinch(s, from, to) {
  const cdp = await s.devtools();
  const box = await s.page.locator("#chart").boundingBox();
  const fingers = (gap) => [-1, 1].map((side, id) => ({ x: box.x + box.width / 2 + (side * gap) / 2, y: box.y + box.height / 2, id }));
  await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: fingers(from) });
  for (let i = 1; i <= 8; i += 1) {
    await cdp.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: fingers(from + ((to - from) * i) / 8) });
  }
  await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
}

export default [
  {
    name: "the map shows each label in its colour",
    ends: true,
    async run(s) {
      if (await s.page.locator("[aria-pressed=true]", { hasText: "Grid" }).count()) await s.button("Grid").click();
      await s.until("the label's colour on the canvas", async () => {
        const cell = await someCell(s);
        const seen = await pixel(s, cell.px, cell.py);
        return seen.join() === cell.tint.join();
      });
    },
  },
  {
    name: "the map pans and zooms by wheel, drag, keys and buttons",
    async run(s) {
      const box = await s.page.locator("#chart").boundingBox();
      const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
      const first = await view(s);
      await s.page.mouse.move(x, y);
      await s.page.mouse.wheel(0, -300);
      await s.until("zoom by wheel", async () => (await view(s)).scale > first.scale * 1.2);
      const zoomed = await view(s);
      await s.page.mouse.down();
      await s.page.mouse.move(x + 90, y + 40, { steps: 4 });
      await s.page.mouse.up();
      const dragged = await view(s);
      assert.ok(Math.abs(dragged.east - (zoomed.east - 90 / zoomed.scale)) < 0.01, "the map follows the pointer");
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("ArrowRight");
      await s.page.keyboard.press("+");
      const keyed = await view(s);
      assert.ok(keyed.east > dragged.east && keyed.scale > dragged.scale);
      await s.button("Fit").click();
      assert.equal((await view(s)).mode, "fit");
    },
  },
  {
    name: "the map zooms by pinching",
    size: PHONE,
    async run(s) {
      const first = await view(s);
      await pinch(s, 60, 180);
      await s.until("twice the scale", async () => (await view(s)).scale > first.scale * 2);
    },
  },
  {
    name: "following keeps the vehicle in the middle",
    async run(s) {
      await s.button("Follow").click();
      await s.until("the vehicle in the middle", () => s.inPage(({ store, view: v, inWorld }) => {
        const { x_m: x, y_m: y } = store.vehicle.status;
        const [east, north] = inWorld(store.vehicle, x, y);
        return Math.hypot(v.east - east, v.north - north) < 1;
      }));
    },
  },
  {
    name: "hovering shows label and age",
    async run(s) {
      // Of a running mission the view and the label of the cell may change between two steps.
      await s.until("the readout of a cell", async () => {
        const cell = await someCell(s);
        await s.page.mouse.move(cell.left + cell.px, cell.top + cell.py);
        const text = await s.page.locator("#readout").innerText({ timeout: 1000 });
        return new RegExp(`Label ${cell.label}\\b.*received .* ago`, "s").test(text);
      });
    },
  },
  {
    name: "a fix moves the map in the world, and a fence stays",
    scenario: "rich",
    async run(s) {
      await s.post("/vehicles/1/fence", { fence: [[-11, -8], [18, -8], [18, 14], [-11, 14]] });
      await s.until("the fence", () => s.inPage(({ store }) => store.vehicle.fence?.fence));
      await s.steer({ placement: { version: 1, east_m: 6, north_m: -2 } });
      await s.until("the move", () => s.inPage(({ store }) => store.vehicle.map.placement));
      await s.button("Fit").click();
      const cell = await s.until("a cell in its colour", async () => {
        const found = await someCell(s);
        const seen = await pixel(s, found.px, found.py);
        return seen.join() === found.tint.join() && found;
      });
      await s.page.mouse.move(cell.left + cell.px, cell.top + cell.py);
      const shown = await s.shows("#readout", new RegExp(`Label ${cell.label}\\b`));
      const [, east] = shown.replaceAll("\u2212", "-").match(/E ([-\d.]+)/);
      assert.ok(Math.abs(Number(east) - (cell.x + 6)) < 0.2, `${shown}: ${cell.x} m on its map`);
      const { fence } = await s.vehicle(1);
      assert.deepEqual(fence.fence[0], [-11, -8]);
      await s.steer({ placement: null });
    },
  },
  {
    name: "the planned path is drawn and its length shown",
    async run(s) {
      await s.button("Fit").click();
      await s.shows("#vehicle", /Path\s*\d waypoints, [\d.]+\sm(, continues)?/s);
      await s.until("dashes on a leg", async () => (await onLeg(s, "text")) > 0.3);
    },
  },
  {
    name: "the planned path follows the plan and disappears with a hold",
    long: true,
    scenario: "rich",
    async run(s) {
      await s.button("Fit").click();
      const first = await s.until("the path", () => plan(s, (c) => c.drawn && c));
      await s.until("dashes on a leg", async () => (await onLeg(s, "text")) > 0.3);
      assert.ok((await onLeg(s, "text")) < 0.95, "a dashed line");
      await s.steer({ placement: { version: 1, east_m: 3, north_m: 2 } });
      await s.until("the move", () => s.inPage(({ store }) => store.vehicle.map.placement));
      await s.until("dashes where it lies now", async () => (await onLeg(s, "text")) > 0.3);
      await s.steer({ placement: null, advance: 40 });
      await s.until("the next plan", () => plan(s, (c, before) => c.drawn && c.at !== before.at, first));
      await s.until("dashes on a leg", async () => (await onLeg(s, "text")) > 0.3);
      await s.post("/vehicles/1/constraints", { action: "hold" });
      await s.until("no path", () => s.inPage(({ store }) => store.vehicle.status.path.length === 0), { advance: 15 });
      await s.shows("#vehicle", /Path\s*–/s);
      await s.post("/vehicles/1/constraints", { action: "resume" });
      await s.until("a path again", () => plan(s, (c) => c.drawn), { advance: 15 });
    },
  },
  {
    name: "the path of a silent vehicle is grey",
    scenario: "silent",
    async run(s) {
      await s.button("Fit").click();
      await s.until("grey dashes", async () => (await onLeg(s, "stale")) > 0.3);
      // The track may cross it.
      assert.ok((await onLeg(s, "text")) < 0.15);
    },
  },
  {
    name: "the surface is on the map while its GPS position is valid",
    scenario: "rich",
    async run(s) {
      const position = { is_valid: true, x_m: 14, y_m: 9, sigma_m: 1.2, lat_deg: 29.5, lon_deg: 34.92, at_s: 1, heading_deg: 45, rejected: {}, outliers: 0, fixes_sent: 3, usbl_rejected: {} };
      await s.steer({ position });
      await s.until("the position", () => s.inPage(({ store }) => store.snapshot.position?.is_valid));
      await s.button("Fit").click();
      const seen = () => s.inPage(({ view, ink }) => {
        const [x, y] = view.toScreen(14, 9);
        const wanted = ink("--map-vehicle");
        const data = document.getElementById("chart").getContext("2d").getImageData(x - 3, y + 3, 1, 1).data;
        return wanted.every((v, n) => Math.abs(v - data[n]) < 12);
      });
      await s.until("the surface on the map", seen);
      await s.steer({ position: { ...position, is_valid: false, x_m: null, y_m: null, sigma_m: null } });
      await s.until("it to be gone", async () => !(await seen()));
      await s.steer({ position: null });
    },
  },
  {
    name: "a tapped cell shows its readout on a phone",
    size: PHONE,
    async run(s) {
      const box = await s.page.locator("#chart").boundingBox();
      await s.page.touchscreen.tap(box.x + box.width / 2, box.y + box.height / 2);
      await s.shows("#readout", /E .* N /s);
    },
  },
  {
    name: "with keys the readout is that of the cross at the centre",
    async run(s) {
      await s.page.keyboard.press("Tab");
      while (!(await s.page.evaluate(() => document.activeElement.id === "chart"))) await s.page.keyboard.press("Tab");
      await s.shows("#readout", /E .* N /s);
    },
  },
  {
    name: "measuring gives the distance between two clicks",
    async run(s) {
      // From here on the view does not follow the mission.
      await s.page.getByRole("button", { name: "Zoom in" }).click();
      await s.button("Measure").click();
      const box = await s.page.locator("#chart").boundingBox();
      await s.page.mouse.click(box.x + 200, box.y + 200);
      await s.page.mouse.click(box.x + 500, box.y + 600);
      const [points, scale] = await s.page.evaluate(async () => {
        const [{ measure }, { view: v }] = await Promise.all([import("/js/map/measure.js"), import("/js/map/chart.js")]);
        return [measure.points, v.scale];
      });
      const metres = Math.hypot(points[1][0] - points[0][0], points[1][1] - points[0][1]);
      assert.ok(Math.abs(metres - 500 / scale) < 0.01, `${metres} against ${500 / scale}`);
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("Escape");
      assert.equal(await s.button("Measure").getAttribute("aria-pressed"), "false");
    },
  },
  {
    name: "the age layer has a legend",
    async run(s) {
      await s.page.selectOption("#layer", "age");
      await s.shows("#legend", /age of cells/);
      await s.page.selectOption("#layer", "label");
      await s.until("no legend", async () => !(await s.page.locator("#legend").isVisible()));
    },
  },
  {
    name: "layers of the server can be chosen, others are hidden",
    scenario: "start",
    async run(s) {
      const names = () => s.page.locator("#layer option").allInnerTexts();
      assert.deepEqual(await names(), ["label", "natural", "age"]);
      await s.steer({ layers: true, advance: 30 });
      await s.until("more layers", async () => (await names()).join() === "label,natural,age,confidence,depth");
      await s.page.selectOption("#layer", "depth");
      await s.shows("#legend", /depth.*10 m.*25 m/s);
      await s.page.selectOption("#layer", "confidence");
      await s.shows("#legend", /confidence.*0.%.*100.%/s);
    },
  },
  {
    name: "every layer of the server is painted on a scale in its unit",
    long: true,
    scenario: "start",
    async run(s) {
      await s.steer({ layers: true, advance: 30 });
      const streams = s.page.getByRole("group", { name: "Use of spare capacity" });
      const names = () => s.page.locator("#layer option").evaluateAll((options) => options.map((option) => option.value));
      for (const { name, unit } of LAYERS) {
        await streams.getByRole("checkbox", { name: name.replaceAll("_", " ") }).check();
        await s.until(`the layer ${name}`, async () => (await names()).includes(name), { advance: 2 });
        await s.page.selectOption("#layer", name);
        await s.shows("#legend", new RegExp(`${name}.*\\d.?${unit || "%"}`, "s"));
      }
    },
  },
  {
    name: "hovering shows the bounds and the age of a level",
    scenario: "start",
    async run(s) {
      await s.steer({ layers: true, advance: 30 });
      await s.until("layers", () => s.inPage(({ store }) => store.map?.layers.length > 0));
      const cell = await someCell(s);
      await s.page.mouse.move(cell.left + cell.px, cell.top + cell.py);
      await s.shows("#readout", /confidence \d+.% to \d+.%, received .* ago/s);
    },
  },
  {
    name: "curiosity has its own colours, and ages when the vehicle is silent",
    long: true,
    scenario: "start",
    async run(s) {
      const names = () => s.page.locator("#layer option").allInnerTexts();
      await s.steer({ layers: true, advance: 30 });
      await s.page.getByRole("group", { name: "Use of spare capacity" }).getByRole("checkbox", { name: "curiosity" }).check();
      await s.until("the order", () => s.posts.at(-1)?.body.background?.at(-1) === "curiosity");
      await s.until("the layer", async () => (await names()).join() === "label,natural,age,confidence,curiosity,depth", { advance: 2 });
      const cell = await someCell(s);
      await s.page.selectOption("#layer", "curiosity");
      await s.shows("#legend", /curiosity\s*up to \d bit\s*\d+ bit and more/);
      const tone = () => s.inPage(async ({ store }, { x, y }) => {
        const { lookOf } = await import("/js/map/layer-look.js");
        const { cellAt } = await import("/js/map/readout.js");
        const level = cellAt(store.map, x, y).layers.find((p) => p.name === "curiosity");
        const of = store.map.layers.find((p) => p.name === "curiosity");
        return lookOf(of).tone(level.level, false);
      }, cell);
      const fresh = await s.until("its colour", async () => {
        const seen = await pixel(s, cell.px, cell.py);
        return seen.join() === (await tone()).join() && seen;
      });
      const ages = async () => {
        await s.page.mouse.move(cell.left + cell.px - 40, cell.top + cell.py);
        await s.page.mouse.move(cell.left + cell.px, cell.top + cell.py);
        await s.shows("#readout", /curiosity \d+ bit to \d+ bit, received .* ago/);
        return (await s.page.locator("#readout").innerText()).match(/curiosity [^·]*/)[0];
      };
      const young = await ages();
      await s.steer({ silent: true, advance: 400 });
      await s.until("an old level", async () => /received \d+\smin/.test(await ages()));
      assert.doesNotMatch(young, /min/);
      const spread = ([r, , b]) => Math.abs(r - b);
      await s.until("pale tones", async () => spread(await pixel(s, cell.px, cell.py)) < spread(fresh) * 0.7);
    },
  },
  {
    name: "a layer of a silent vehicle turns grey",
    scenario: "start",
    async run(s) {
      await s.steer({ layers: true, advance: 30 });
      await s.until("layers", () => s.inPage(({ store }) => store.map?.layers.length > 0));
      await s.page.selectOption("#layer", "depth");
      const tones = () =>
        s.page.locator("#chart").evaluate((c) => {
          const { data } = c.getContext("2d").getImageData(0, 0, c.width, c.height);
          let most = 0;
          for (let i = 0; i < data.length; i += 4) most = Math.max(most, Math.abs(data[i] - data[i + 2]));
          return most;
        });
      const live = await s.until("the layer to be painted", async () => {
        const most = await tones();
        return most > 60 && most;
      });
      await s.steer({ silent: true, advance: 400 });
      await s.until("pale tones", async () => (await tones()) < live * 0.7);
    },
  },
  {
    name: "a block of which one cell was sent is pale and not counted",
    scenario: "empty",
    async run(s) {
      await s.steer({ coarse: true, loss: 0, advance: 40 });
      await s.shows("#legend", /pale: one cell of 16 was sent/);
      const block = await s.inPage(async ({ store, view: v, tintOf, shownAs }) => {
        const { coarseBlocks } = await import("/js/map/coarse.js");
        const m = store.map;
        const box = document.getElementById("chart").getBoundingClientRect();
        const far = ([x, y]) => store.vehicle.track.every(([, tx, ty]) => Math.hypot(tx - x, ty - y) > 1);
        const place = (b, d) => [(b.x + d) * m.cell_m, (b.y + d) * m.cell_m];
        const b = coarseBlocks(m).find((k) => far(place(k, 1.5)));
        return { sent: v.toScreen(...place(b, 0.5)), rest: v.toScreen(...place(b, 2.5)), left: box.left, top: box.top, tint: tintOf(shownAs(b.label)), known: [...m.cells()].length };
      });
      assert.deepEqual(await pixel(s, ...block.sent), block.tint);
      const pale = await pixel(s, ...block.rest);
      const sea = await s.inPage(({ ink }) => ink("--map-sea"));
      assert.notDeepEqual(pale, block.tint);
      assert.notDeepEqual(pale, sea);
      await s.page.mouse.move(block.left + block.rest[0], block.top + block.rest[1]);
      await s.shows("#readout", /not sent; Label \d+ at the one cell of 16 that was sent/);
      assert.equal(block.known, (await s.vehicle()).map.explored_cells);
      await s.page.mouse.move(5, 5);
      await s.steer({ coarse: false, advance: 30 });
      await s.until("the whole map", async () => !(await s.page.locator("#legend").isVisible()));
    },
  },
  {
    name: "a map that was sent cell by cell has no pale blocks",
    scenario: "rich",
    async run(s) {
      const blocks = await s.inPage(async ({ store }) => (await import("/js/map/coarse.js")).coarseBlocks(store.map).length);
      assert.equal(blocks, 0);
    },
  },
  {
    name: "grid and rings are remembered",
    long: true,
    async run(s) {
      const rings = () => s.button("Rings").getAttribute("aria-pressed");
      assert.equal(await rings(), "false");
      await s.button("Rings").click();
      await s.page.reload();
      await s.ready();
      assert.equal(await rings(), "true");
    },
  },
  {
    name: "an empty map says what appears and when",
    scenario: "empty",
    run: (s) => s.shows("#map-empty", /No frame received from auv-1 yet.*appear here.*expected every \d+.s/),
  },
  {
    name: "a second vehicle can be selected",
    scenario: "two",
    async run(s) {
      await s.page.getByRole("button", { name: /auv-2/ }).click();
      await s.shows("#vehicle h2", /auv-2/);
      assert.equal(await s.inPage(({ store }) => store.selectedId), 2);
      const { labels } = await s.vehicle(2);
      await s.until("its labels", async () => (await s.page.locator(".label").count()) === labels.length);
    },
  },
];
