import assert from "node:assert/strict";
import { PHONE, WIDE } from "../stage.mjs";

/** An explored cell near the middle of the view: its label, its place on the page, and in the world. */
const aCell = (s) =>
  s.inPage(({ store, view: v, inWorld, shownAs }) => {
    const m = store.map;
    const box = document.getElementById("chart").getBoundingClientRect();
    const cells = [...m.cells()].map((cell) => {
      const [x, y] = inWorld(store.vehicle, (cell.x + 0.5) * m.cell_m, (cell.y + 0.5) * m.cell_m);
      const [px, py] = v.toScreen(x, y);
      return { label: shownAs(cell.label), x, y, px: px + box.left, py: py + box.top, away: Math.hypot(px - v.width / 2, py - v.height / 2) };
    });
    return cells.sort((a, b) => a.away - b.away)[0];
  });

const plate = "#place";

const uncovered = [WIDE, PHONE].map((size) => ({
  name: `the plate of a place leaves the place in view: ${size.width} px`,
  size,
  scenario: "rich",
  async run(s) {
    const map = await s.page.locator("#chart").boundingBox();
    for (const [x, y] of [[0.1, 0.9], [0.48, 0.6], [0.52, 0.6], [0.95, 0.9]]) {
      const at = [map.x + x * map.width, map.y + y * map.height];
      await s.page.mouse.click(...at);
      await s.visible(plate);
      const box = await s.page.locator(plate).boundingBox();
      const isCovered = at[0] >= box.x && at[0] <= box.x + box.width && at[1] >= box.y && at[1] <= box.y + box.height;
      assert.ok(!isCovered, `${at} in ${JSON.stringify(box)}`);
      assert.ok(box.x >= map.x && box.x + box.width <= map.x + map.width, `within the map: ${JSON.stringify(box)}`);
      await s.button("Close the place").click();
    }
  },
}));

export default [
  ...uncovered,
  {
    name: "a click on the map chooses the place: its label, its age, the row in the list",
    scenario: "start",
    async run(s) {
      const cell = await aCell(s);
      await s.page.locator(`.label[data-key='${cell.label}'] .request`).click();
      await s.until("an image", () => s.page.locator(`.label[data-key='${cell.label}'] .image`).isVisible(), { advance: 20 });
      await s.page.mouse.click(cell.px, cell.py);
      const name = await s.inPage(({ nameOf }, id) => nameOf(id), cell.label);
      await s.shows(plate, new RegExp(`E .* N .*${name}.*received .* ago`, "s"));
      assert.ok(await s.page.locator(`.label.here[data-key='${cell.label}']`).isVisible(), "the row is marked and in view");
      await s.page.locator(`${plate} .place-images .image`).first().click();
      await s.shows("#dialog", new RegExp(name));
      await s.page.locator("#dialog").getByRole("button", { name: "Close" }).click();
      await s.page.getByRole("button", { name: "Close the place" }).click();
      assert.equal(await s.page.locator(plate).isVisible(), false);
      assert.equal(await s.page.locator(".label.here").count(), 0);
    },
  },
  {
    name: "the plate of a place names the labels that the cell had before",
    scenario: "start",
    async run(s) {
      const cell = await aCell(s);
      await s.page.mouse.click(cell.px, cell.py);
      await s.shows(plate, /received .* ago/);
      const other = cell.label === 1 ? 2 : 1;
      await s.steer({ label_at: { x_m: cell.x, y_m: cell.y, label: other } });
      const names = await s.inPage(({ nameOf }, ids) => ids.map(nameOf), [other, cell.label]);
      await s.shows(plate, new RegExp(`${names[0]}.*received .* ago.*${names[1]} until .* ago`, "s"));
    },
  },
  {
    name: "a marker is set at a place, is shown on the map, and is removed",
    scenario: "start",
    async run(s) {
      const cell = await aCell(s);
      await s.page.mouse.click(cell.px, cell.py);
      await s.page.getByLabel("Text of the marker").fill("an old anchor");
      await s.page.getByRole("button", { name: "Set marker" }).click();
      await s.until("the marker", () => s.inPage(({ store }) => store.vehicle.markers.length === 1), { advance: 1 });
      const marker = (await s.get("/state")).vehicles[0].markers[0];
      assert.ok(Math.hypot(marker.x_m - cell.x, marker.y_m - cell.y) < 0.3, JSON.stringify([marker, cell]));
      assert.equal(await s.page.locator(plate).isVisible(), false);
      // The pin stands above its place; its foot chooses it.
      await s.page.mouse.click(cell.px + 3, cell.py - 4);
      await s.shows(plate, /an old anchor/);
      await s.page.getByRole("button", { name: "Remove marker" }).click();
      await s.until("no marker", () => s.inPage(({ store }) => store.vehicle.markers.length === 0), { advance: 1 });
    },
  },
  {
    name: "the vehicle is sent to a place, the plate shows how far the order has come, and the order is withdrawn",
    scenario: "start",
    async run(s) {
      const cell = await aCell(s);
      await s.page.mouse.click(cell.px, cell.py);
      await s.button("Go there").click();
      await s.shows(`${plate} .steps [aria-current]`, /Applied/, { ms: 240000, advance: 2 });
      const vehicle = (await s.get("/state")).vehicles[0];
      const [x, y] = vehicle.destination_in_force.order.place;
      assert.ok(Math.hypot(x - cell.x, y - cell.y) < 0.3, JSON.stringify([x, y, cell]));
      await s.button("Close the place").click();
      const [px, py] = await s.inPage(({ view }, place) => view.toScreen(...place), [x, y]);
      const box = await s.page.locator("#chart").boundingBox();
      await s.page.mouse.click(box.x + px + 2, box.y + py + 2);
      await s.button("Withdraw the destination").click();
      await s.until("no destination", () => s.inPage(({ store }) => store.vehicle.destination_in_force === null), { ms: 240000, advance: 2 });
      assert.ok(await s.button("Go there").isVisible());
    },
  },
  {
    name: "a destination that the vehicle refuses shows the reason",
    scenario: "start",
    async run(s) {
      await s.steer({ refuse: "destination", loss: 0 });
      const cell = await aCell(s);
      await s.page.mouse.click(cell.px, cell.py);
      await s.button("Go there").click();
      await s.shows(`${plate} .order-status`, /Refused.*a constraint in force/s, { advance: 3 });
      assert.ok(await s.button("Go there").isVisible(), "it can be given again");
    },
  },
  {
    name: "with the keyboard the cross chooses the place, and Escape leaves it",
    scenario: "start",
    async run(s) {
      await s.page.locator("#chart").focus();
      await s.page.keyboard.press("ArrowLeft");
      await s.page.keyboard.press("Enter");
      await s.shows(plate, /E .* N/);
      await s.page.keyboard.press("Escape");
      assert.equal(await s.page.locator(plate).isVisible(), false);
    },
  },
];
