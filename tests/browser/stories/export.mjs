import assert from "node:assert/strict";
import { regions } from "../../../daemon/console/js/export/regions.js";
import { readFile } from "node:fs/promises";

/** Clicks a file's button; resolves to its downloads by extension, as text or bytes. */
async function take(s, name, count = 1) {
  const files = {};
  const arrived = new Promise((resolve) => {
    s.page.on("download", async (d) => {
      files[d.suggestedFilename().split(".").pop()] = await readFile(await d.path());
      if (Object.keys(files).length === count) resolve(files);
    });
  });
  await s.button("Export").click();
  await s.button(name).click();
  return arrived;
}

/** The map that the page holds, after the mission stopped changing it. */
async function frozen(s) {
  await s.steer({ ended: true });
  await s.until("the last map", async () => {
    const { map } = await s.vehicle();
    return (await s.inPage(({ store }) => store.map.version)) === map.version;
  });
  return s.vehicle();
}

const area = (ring) => ring.slice(1).reduce((sum, [x, y], i) => sum + ring[i][0] * y - x * ring[i][1], 0) / 2;

/** A grid of noise: small patches, holes in holes, corners that touch. */
function noise(seed, width, height) {
  let state = seed;
  return Uint8Array.from({ length: width * height }, () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return (state >>> 24) % 4;
  });
}

export default [
  {
    name: "outlines of noise have the area of its cells",
    bare: true,
    run() {
      for (let seed = 1; seed <= 40; seed += 1) {
        const values = noise(seed, 13 + (seed % 5), 11);
        for (const [value, polygons] of regions(values, 13 + (seed % 5), 11)) {
          const cells = values.filter((v) => v === value).length;
          assert.equal(polygons.flat().reduce((n, ring) => n + area(ring), 0), cells, `seed ${seed}, value ${value}`);
          assert.ok(polygons.every(([outer, ...holes]) => area(outer) > 0 && holes.every((h) => area(h) < 0)));
        }
      }
    },
  },
  {
    name: "CSV has a line for each explored cell",
    scenario: "rich",
    async run(s) {
      const { map } = await frozen(s);
      const { csv } = await take(s, "CSV");
      const lines = String(csv).trim().split("\n");
      assert.equal(lines[0], "east_m,north_m,label,shown_as,name,age_s");
      assert.equal(lines.length - 1, map.explored_cells);
    },
  },
  {
    name: "GeoJSON regions have the areas of the list, rings closed, outer ones anticlockwise",
    scenario: "rich",
    async run(s) {
      const { labels } = await frozen(s);
      const { geojson } = await take(s, "GeoJSON");
      const { features } = JSON.parse(geojson);
      assert.equal(features.length, labels.length);
      for (const f of features) {
        const polygons = f.geometry.coordinates;
        const sum = polygons.flat().reduce((n, ring) => n + area(ring), 0);
        const { area_m2: wanted } = labels.find((l) => l.id === f.properties.label);
        assert.ok(Math.abs(sum - wanted) < 1e-6, `label ${f.id}: ${sum} against ${wanted}`);
        assert.ok(polygons.every(([outer, ...holes]) => area(outer) > 0 && holes.every((h) => area(h) < 0)));
        assert.ok(polygons.flat().every((r) => r.length > 3 && r[0].join() === r.at(-1).join()));
      }
    },
  },
  {
    name: "PNG comes with a world file that puts it in place",
    scenario: "rich",
    async run(s) {
      const { map } = await frozen(s);
      const { png, pgw } = await take(s, "PNG and world file", 2);
      assert.equal(png.readUInt32BE(16), map.width);
      assert.equal(png.readUInt32BE(20), map.height);
      const [w, , , h, west, north] = String(pgw).trim().split("\n").map(Number);
      assert.deepEqual([w, h], [map.cell_m, -map.cell_m]);
      assert.equal(west, (map.x0 + 0.5) * map.cell_m);
      assert.equal(north, (map.y0 + map.height - 0.5) * map.cell_m);
    },
  },
  {
    name: "PLY has a vertex for each explored cell",
    scenario: "rich",
    async run(s) {
      const { map } = await frozen(s);
      const { ply } = await take(s, "PLY");
      const [head, body] = String(ply).split("end_header\n");
      assert.match(head, new RegExp(`^ply\\nformat ascii 1.0\\n[^]*element vertex ${map.explored_cells}\\n`));
      assert.equal(body.trim().split("\n").length, map.explored_cells);
    },
  },
];
