import assert from "node:assert/strict";

/** Texts that show a figure, in a tab of the page: those with a digit that are visible, each with what is said about it. */
const figures = (s) =>
  s.page.evaluate(() => {
    const found = [];
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
      const text = texts.currentNode.data.trim();
      const element = texts.currentNode.parentElement;
      if (!/\d/.test(text) || !element.checkVisibility() || element.closest("option, code, .log, .name, .hint, h2, summary, .first-mission, [aria-hidden]")) continue;
      const help = element.closest("[title]")?.title ?? element.closest("label, fieldset")?.querySelector("[title]")?.title ?? "";
      found.push({ text, help, path: `${element.closest("section, dialog, header, aside, div")?.id ?? ""} ${element.tagName}.${element.className}` });
    }
    return found;
  });

export default [
  {
    name: "every figure says on hovering what it is",
    scenario: "rich",
    async run(s) {
      const bare = new Set();
      for (const tab of ["Vehicle", "Constraints", "Model", "Log"]) {
        await s.page.getByRole("tab", { name: tab }).click();
        for (const { text, help, path } of await figures(s)) if (help === "") bare.add(`${tab}: ${path}: ${text}`);
      }
      assert.deepEqual([...bare], []);
    },
  },
];
