import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";

const EXTENSIONS = ["png", "pgw", "png.aux.xml", "tif", "tif.aux.xml", "csv", "labels.csv", "geojson", "coco.json", "taglab.json", "ply"];

/** Clicks a link of the export dialog; resolves to the name and the bytes of the file. */
async function take(s, title) {
  const [download] = await Promise.all([s.page.waitForEvent("download"), s.page.getByRole("link", { name: title, exact: true }).click()]);
  return [download.suggestedFilename(), await readFile(await download.path())];
}

export default [
  {
    name: "each file of the map comes from the server under its name",
    scenario: "rich",
    async run(s) {
      await s.button("Export").click();
      const links = await s.page.locator("#dialog .files a").evaluateAll((all) => all.map((a) => [a.getAttribute("href"), a.download]));
      const { map } = await s.vehicle();
      assert.deepEqual(links, EXTENSIONS.map((e) => [`/api/v2/vehicles/1/map.${e}`, `rich-auv-1-v${map.version}.${e}`]));
      const [name, bytes] = await take(s, "CSV");
      assert.deepEqual([name, String(bytes)], [`rich-auv-1-v${map.version}.csv`, "map.csv of the mock"]);
    },
  },
  {
    name: "a wide map is offered in formats that can hold it",
    long: true,
    scenario: "wide",
    async run(s) {
      await s.button("Export").click();
      const links = await s.page.locator("#dialog .files a").evaluateAll((all) => all.map((a) => a.getAttribute("href").split("/map.")[1]));
      assert.deepEqual(links, ["tif", "tif.aux.xml", "csv", "labels.csv", "geojson", "ply"]);
    },
  },
  {
    name: "CSV, GeoJSON and PLY have the cells of the map",
    ends: true,
    unmocked: true,
    async run(s) {
      await s.button("Export").click();
      // The mission continues: the files and the map must be of the same version.
      const [csv, geojson, ply, cells] = await s.until("files of one version", async () => {
        const before = await s.get("/vehicles/1/map");
        const files = [];
        for (const title of ["CSV", "GeoJSON", "PLY"]) files.push(String((await take(s, title))[1]));
        const after = await s.get("/vehicles/1/map");
        const explored = Buffer.from(after.labels, "base64").filter((label) => label !== 0).length;
        return before.version === after.version && [...files, explored];
      });
      assert.match(csv, /^east_m,north_m,label,age_s/);
      assert.equal(csv.trim().split("\n").length - 1, cells);
      const { features } = JSON.parse(geojson);
      const area = (ring) => ring.slice(1).reduce((sum, [x, y], i) => sum + ring[i][0] * y - x * ring[i][1], 0) / 2;
      for (const { geometry } of features) {
        assert.ok(geometry.coordinates.every(([outer, ...holes]) => area(outer) > 0 && holes.every((h) => area(h) < 0)));
        assert.ok(geometry.coordinates.flat().every((r) => r.length > 3 && r[0].join() === r.at(-1).join()));
      }
      assert.ok(ply.includes(`\nelement vertex ${cells}\n`));
      assert.equal(ply.split("end_header\n")[1].trim().split("\n").length, cells);
    },
  },
  {
    name: "the PNG comes with a world file that puts it in place",
    ends: true,
    unmocked: true,
    async run(s) {
      await s.button("Export").click();
      const [png, world, vehicle] = await s.until("files of one version", async () => {
        const before = await s.vehicle();
        const files = [(await take(s, "PNG"))[1], String((await take(s, "World file"))[1])];
        const after = await s.vehicle();
        const same = before.map.version === after.map.version && before.map.placement?.version === after.map.placement?.version;
        return same && [...files, after];
      });
      const { map } = vehicle;
      assert.deepEqual([png.readUInt32BE(16), png.readUInt32BE(20)], [map.width, map.height]);
      const [w, , , h, west, north] = world.trim().split("\n").map(Number);
      assert.deepEqual([w, h], [map.cell_m, -map.cell_m]);
      const { east_m: east, north_m: up } = map.placement ?? { east_m: 0, north_m: 0 };
      assert.ok(Math.abs(west - ((map.x0 + 0.5) * map.cell_m + east)) < 1e-6, `${west}`);
      assert.ok(Math.abs(north - ((map.y0 + map.height - 0.5) * map.cell_m + up)) < 1e-6, `${north}`);
    },
  },
];
