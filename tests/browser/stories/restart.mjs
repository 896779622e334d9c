import assert from "node:assert/strict";

const EARLIER = { run: 1, current_run: 2, current_epoch: 3, current_cells: 12 };

export default [
  {
    name: "an earlier map is marked until the operator dismisses it",
    scenario: "rich",
    async run(s) {
      await s.steer({ earlier: EARLIER });
      await s.shows("#banners", /map of auv-1 in view is an earlier one.*of run 1, label epoch 0.*12 of its \d+ cells.*in run 2, label epoch 3/s);
      await s.page.locator("#banners button", { hasText: "Show the current map" }).click();
      await s.visible("#banners", false);
    },
  },
  {
    name: "a disk that refuses is reported with its reason",
    scenario: "rich",
    async run(s) {
      const storage = { folder: "state/asv", free_bytes: 1_500_000, write_errors: 3, failing: "surface.store: No space left on device" };
      await s.steer({ storage });
      await s.shows("#banners", /cannot write its files.*No space left on device.*state\/asv.*Free: 1 MB/s);
      await s.steer({ storage: { ...storage, failing: null } });
      await s.visible("#banners", false);
    },
  },
  {
    name: "a vehicle's disk is shown with its refusals and its free space",
    scenario: "rich",
    async run(s) {
      const disk = { journal_refused: false, checkpoint_refused: false, free_bytes: 2 ** 34 };
      const row = s.page.locator("#vehicle .values > div", { hasText: "Vehicle's disk" });
      const isWarning = () => row.evaluate((node) => node.classList.contains("warn"));
      await s.shows("#vehicle .values", /Vehicle's disk\s*at least 17\sGB free/);
      assert.equal(await isWarning(), false);
      await s.visible("#banners", false);
      await s.steer({ disk: { ...disk, free_bytes: 2 ** 29 } });
      await s.shows("#vehicle .values", /Vehicle's disk\s*at least 536\sMB free/);
      assert.equal(await isWarning(), true);
      await s.visible("#banners", false);
      await s.steer({ disk: { ...disk, checkpoint_refused: true, free_bytes: 0 } });
      await s.shows("#banners", /auv-1 cannot write its checkpoint.*less than 1\sMB free.*lose the scene model/s);
      await s.steer({ disk: { ...disk, journal_refused: true } });
      await s.shows("#banners", /auv-1 cannot write its journal.*Reported .* ago.*obeys hold and abort from memory and refuses other orders/s);
      await s.shows("#vehicle .values", /refuses journal, at least 17\sGB free/);
      assert.equal(await isWarning(), true);
      await s.steer({ disk });
      await s.visible("#banners", false);
    },
  },
  {
    name: "faults of a vehicle's equipment are a row, and a banner if the survey does not proceed with them",
    scenario: "rich",
    async run(s) {
      const row = s.page.locator("#vehicle .values > div", { hasText: "Faults" });
      assert.equal(await row.isVisible(), false);
      await s.steer({ faults: [{ text: "images are dropped", is_grave: false }] });
      await s.shows("#vehicle .values", /Faults\s*images are dropped/);
      await s.visible("#banners", false);
      await s.steer({ faults: [{ text: "no image comes in", is_grave: true }, { text: "images are dropped", is_grave: false }] });
      await s.shows("#banners", /auv-1: no image comes in.*As reported .* ago/s);
      await s.shows("#vehicle .values", /Faults\s*no image comes in, images are dropped/);
      await s.steer({ faults: [] });
      await s.visible("#banners", false);
      assert.equal(await row.isVisible(), false);
    },
  },
  {
    name: "orders in force that are unknown here are named until they are known",
    scenario: "rich",
    async run(s) {
      await s.steer({ in_force: { fence: "unknown", utility: "unknown" } });
      await s.shows("#banners", /auv-1 follows orders that are unknown here.*In force, unknown here: utility, fence/s);
      await s.steer({ in_force: {} });
      await s.visible("#banners", false);
    },
  },
  {
    name: "frames that are refused are explained until one is accepted",
    scenario: "rich",
    async run(s) {
      const mismatch = "it has wire version 2, this end has 3: install the same release at both ends";
      await s.steer({ mismatch });
      await s.shows("#banners", /The settings of auv-1 do not fit.*wire version 2, this end has 3/s);
      await s.steer({ mismatch: null });
      await s.visible("#banners", false);
    },
  },
  {
    name: "archived maps are listed with their files",
    scenario: "rich",
    async run(s) {
      const map = { name: "archive-1-epoch-0-run-1-5", vehicle: 1, vehicle_name: "auv-1", run: 1, epoch: 0, cells: 40, ended_s: 10 };
      await s.steer({ archive: [map] });
      await s.page.locator("#tools button", { hasText: "Export" }).click();
      await s.shows("#dialog .archive", /auv-1, run 1, label epoch 0.*40 cells, ended .* ago/s);
      const links = await s.page.locator("#dialog .archive a").evaluateAll((all) => all.map((a) => a.getAttribute("href")));
      assert.deepEqual(links, ["png", "tif", "csv", "geojson", "ply"].map((e) => `/api/v2/archive/${map.name}/map.${e}`));
    },
  },
];
