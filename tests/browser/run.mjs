// Runs every user story of the operator's page in headless Chromium.
//
//   node run.mjs                        against the mock
//   node run.mjs --url http://HOST:PORT against a running daemon (stories that need the mock are skipped)
//   --only A,B   only stories whose name holds A or B      --require   a missing browser is a failure

import { existsSync } from "node:fs";
import { LAUNCH } from "./browser.mjs";
import { startMock } from "./mock/server.mjs";
import { Stage } from "./stage.mjs";

const option = (name) => {
  const at = process.argv.indexOf(`--${name}`);
  return at > 0 ? process.argv[at + 1] : null;
};

const STORIES = ["map", "labels", "vehicle", "constraints", "model", "link", "truth", "export", "cloud", "access", "cost"];

async function stories() {
  const modules = await Promise.all(STORIES.map((s) => import(`./stories/${s}.mjs`)));
  const only = option("only")?.split(",");
  return modules.flatMap((m) => m.default).filter((s) => !only || only.some((part) => s.name.includes(part)));
}

async function main() {
  if (!existsSync(LAUNCH.executablePath)) {
    console.log(`skipped: no browser at ${LAUNCH.executablePath}`);
    return process.argv.includes("--require") ? 1 : 0;
  }
  const { chromium } = await import("playwright-core");
  const url = option("url")?.replace(/\/$/, "");
  const mock = url ? null : await startMock();
  const browser = await chromium.launch(LAUNCH);
  const counts = { ok: 0, failed: 0, skipped: 0 };
  for (const story of await stories()) {
    const outcome = await run(story, browser, url ?? mock.url, mock !== null);
    counts[outcome] += 1;
  }
  await browser.close();
  await mock?.close();
  console.log(`${counts.ok} passed, ${counts.failed} failed, ${counts.skipped} skipped`);
  return counts.failed > 0 ? 1 : 0;
}

async function run(story, browser, url, mocked) {
  if (story.scenario && !mocked) {
    console.log(`skip  ${story.name} (needs the mock)`);
    return "skipped";
  }
  const start = performance.now();
  const stage = new Stage();
  try {
    await stage.open(browser, url, story, mocked);
    await story.run(stage);
    stage.noErrors(story.tolerates);
    console.log(`ok    ${story.name} (${Math.round(performance.now() - start)} ms)`);
    return "ok";
  } catch (error) {
    console.log(`FAIL  ${story.name}\n      ${String(error.stack ?? error).replaceAll("\n", "\n      ")}`);
    return "failed";
  } finally {
    await stage.close();
  }
}

process.exit(await main());
