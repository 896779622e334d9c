// Runs every user story of the operator's page in headless Chromium. Each story runs once.
//
//   node run.mjs                          against the mock
//   node run.mjs --url http://HOST:PORT   against a running daemon: the stories that need no mock
//   ... --token-file FILE                 against one with a token: to log in
//   ... --runs N                          each story N times, to find unstable ones
//   ... --workers N                       N stories at a time, each with a mock of its own
//   ... --limits                          the stories that measure time assert its limits, which hold on a quiet machine only
//   ... --brief                           without stories that repeat another in the other themes ("again") or take seconds for what no
//                                         order depends on ("long"); against a running daemon, only those in which page, surface and
//                                         vehicle take part ("ends")
//   --only A,B   only stories whose name contains A or B      --require   a missing browser is a failure

import { existsSync, readFileSync } from "node:fs";
import { LAUNCH } from "./browser.mjs";
import { startMock } from "./mock/server.mjs";
import { Stage } from "./stage.mjs";

const option = (name) => {
  const at = process.argv.indexOf(`--${name}`);
  return at > 0 ? process.argv[at + 1] : null;
};

const STORIES = ["entrance", "map", "rehearsal", "natural", "place", "labels", "vehicle", "constraints", "model", "log", "help", "link", "replay", "truth", "export", "restart", "cloud", "access", "audit", "command", "wide", "cost"];

async function stories() {
  const modules = await Promise.all(STORIES.map((s) => import(`./stories/${s}.mjs`)));
  const only = option("only")?.split(",");
  const stories = modules.flatMap((m) => m.default).filter((s) => !only || only.some((part) => s.name.includes(part)));
  if (!process.argv.includes("--brief")) return stories;
  return stories.filter((s) => (option("url") ? s.ends || s.locked : !s.again && !s.long));
}

/** The environment that a story requires and this run lacks, or null. */
function missing(story, { mocked, token }) {
  if (story.scenario && !mocked) return "the mock";
  if (story.unmocked && mocked) return "a running daemon";
  return Boolean(story.locked) === Boolean(token) ? null : story.locked ? "a daemon with a token" : "a daemon without a token";
}

async function main() {
  if (!existsSync(LAUNCH.executablePath)) {
    console.log(`skipped: no browser at ${LAUNCH.executablePath}`);
    return process.argv.includes("--require") ? 1 : 0;
  }
  const { chromium } = await import("playwright-core");
  const all = await stories();
  const url = option("url")?.replace(/\/$/, "");
  const token = option("token-file") && readFileSync(option("token-file"), "utf8").trim();
  const browser = await chromium.launch(LAUNCH);
  const counts = { ok: 0, failed: 0, skipped: 0 };
  const waiting = Array.from({ length: Number(option("runs") ?? 1) }, () => all).flat();
  const work = async () => {
    const mock = url ? null : await startMock();
    const scene = { url: url ?? mock.url, mocked: mock !== null, token, limits: process.argv.includes("--limits") };
    const kept = { context: null, page: null };
    while (waiting.length > 0) counts[await run(waiting.shift(), browser, scene, kept)] += 1;
    await mock?.close();
  };
  await Promise.all(Array.from({ length: Number(option("workers") ?? 1) }, work));
  await browser.close();
  console.log(`${counts.ok} passed, ${counts.failed} failed, ${counts.skipped} skipped`);
  return counts.failed > 0 ? 1 : 0;
}

async function run(story, browser, scene, kept) {
  const needed = missing(story, scene);
  if (needed) {
    console.log(`skip  ${story.name} (needs ${needed})`);
    return "skipped";
  }
  const start = performance.now();
  const stage = new Stage();
  let passed = false;
  try {
    await stage.open(browser, scene, story, kept);
    await story.run(stage);
    await stage.noErrors(story.tolerates);
    console.log(`ok    ${story.name} (${Math.round(performance.now() - start)} ms)`);
    if (stage.figures.length > 0) console.log(`      figures: ${stage.figures.join(", ")}`);
    passed = true;
    return "ok";
  } catch (error) {
    console.log(`FAIL  ${story.name}\n      ${[error.stack ?? error, ...stage.errors].join("\n").replaceAll("\n", "\n      ")}`);
    return "failed";
  } finally {
    await stage.close(kept, passed);
  }
}

process.exit(await main());
