// The audit of a page by axe.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");

/** No violation of WCAG 2.2 A and AA. The policy of the page forbids inline scripts, so axe is loaded through the devtools. */
export async function clean(s, least = 20) {
  if (!(await s.page.evaluate("Boolean(window.axe)"))) await s.page.evaluate(await readFile(AXE, "utf8"));
  const { violations, passes } = await s.page.evaluate(async () => {
    const runOnly = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"];
    // Each element that passes would be described too, which takes time.
    const { violations, passes } = await window.axe.run(document, { runOnly, resultTypes: ["violations"] });
    const told = (v) => `${v.id}: ${v.nodes.map((n) => `${n.target} ${n.failureSummary}`).join("; ")}`;
    return { violations: violations.map(told), passes: passes.length };
  });
  assert.ok(passes > least, `axe looked at the page: ${passes} rules pass`);
  assert.deepEqual(violations, []);
}
