// Audits by axe of all tabs at the middle size and of all dialogs, and the rows of the bar.

import assert from "node:assert/strict";
import { clean } from "../axe.mjs";
import { MIDDLE, PHONE, WIDE } from "../stage.mjs";

const THEMES = ["light", "dark", "red"];
const TABS = ["Labels", "Vehicle", "Constraints", "Link", "Model", "Log"];

const tabs = THEMES.map((theme) => ({
  name: `axe finds no fault in any tab: ${theme}, ${MIDDLE.width} px`,
  theme, again: theme !== "light",
  size: MIDDLE,
  scenario: "rich",
  async run(s) {
    for (const tab of TABS) {
      await s.page.getByRole("tab", { name: tab }).click();
      await clean(s);
    }
  },
}));

/** Rules that pass at least: behind a modal dialog, the rest of the page is inert and not audited. */
const LEAST_IN_DIALOG = 10;

/** Buttons that open a dialog. Keys has none on the phone. */
const OPENERS = ["#command", "#bar-hold", "#bar-abort", "#keys-open", "#tools >> text=Export"];

const dialogs = THEMES.flatMap((theme) => [WIDE, PHONE].map((size) => ({
  name: `axe finds no fault in any dialog: ${theme}, ${size.width} px`,
  theme, again: theme !== "light",
  size,
  scenario: "rich",
  async run(s) {
    for (const opener of OPENERS) {
      const button = s.page.locator(opener);
      if (!(await button.isVisible())) continue;
      await button.click();
      await s.page.locator("#dialog[open]").waitFor();
      await clean(s, LEAST_IN_DIALOG);
      await s.page.keyboard.press("Escape");
    }
    await s.page.locator(".exemplar .request").first().click();
    const image = s.page.locator(".exemplar .image").first();
    await s.until("an image", () => image.isVisible(), { advance: 20 });
    await image.click();
    await s.page.locator("#dialog[open] img").first().waitFor();
    await clean(s, LEAST_IN_DIALOG);
  },
})));

const rows = THEMES.flatMap((theme) => [[MIDDLE, 1], [PHONE, 2]].map(([size, most]) => ({
  name: `the bar has at most ${most} ${most === 1 ? "row" : "rows"} and no text in two lines: ${theme}, ${size.width} px`,
  theme, again: theme !== "light",
  size,
  scenario: "rich",
  async run(s) {
    await s.shows("#command", /Nobody has command/);
    const [middles, broken] = await s.page.evaluate(() => {
      const shown = (selector) => [...document.querySelectorAll(selector)].filter((e) => e.checkVisibility());
      const bar = shown("#bar > *").map((e) => e.getBoundingClientRect()).filter((r) => r.height > 1);
      const lines = (e) => new Set([...Array(e.childNodes.length).keys()].flatMap((i) => {
        const range = document.createRange();
        range.selectNode(e.childNodes[i]);
        return [...range.getClientRects()].map((r) => Math.round(r.bottom / 8));
      })).size;
      return [bar.map((r) => (r.top + r.bottom) / 2), shown("#bar button:not(.vehicle-choice), #bar > p, #tabs button").filter((e) => lines(e) > 1).map((e) => e.id)];
    });
    const distinct = middles.filter((y, i) => middles.findIndex((other) => Math.abs(other - y) < 6) === i);
    assert.ok(distinct.length <= most, `rows at ${distinct}`);
    assert.deepEqual(broken, [], "no text in two lines");
  },
})));

export default [...tabs, ...dialogs, ...rows];
