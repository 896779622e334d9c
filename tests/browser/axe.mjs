// The audit of a page by axe.

import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");

/** No violation of WCAG 2.2 A and AA. The policy of the page forbids inline scripts, so axe is loaded through the devtools. */
export async function clean(s, least = 20) {
  await s.page.evaluate(await readFile(AXE, "utf8"));
  const { violations, passes } = await s.page.evaluate(() =>
    window.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"] }));
  assert.ok(passes.length > least, `axe looked at the page: ${passes.length} rules pass`);
  assert.deepEqual(violations.map((v) => `${v.id}: ${v.nodes.map((n) => `${n.target} ${n.failureSummary}`).join("; ")}`), []);
}
