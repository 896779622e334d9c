// What a story works with: a fresh page, the API, the mock's levers, patient checks.

import assert from "node:assert/strict";

export const WIDE = { width: 1440, height: 900 };
export const PHONE = { width: 390, height: 844 };

/** How long a step may take on a loaded machine; what passes does not wait for it. */
const PATIENCE_MS = 30000;

export class Stage {
  /** What a story has measured, for people. */
  figures = [];

  /** A new context with the page open and its first state shown. */
  async open(browser, { url, mocked, token }, story) {
    Object.assign(this, { url, mocked, token, browser });
    this.errors = [];
    this.posts = [];
    if (mocked) await this.steer({ scenario: story.scenario ?? "rich", down: false, stream: true, mute: false });
    const size = story.size ?? WIDE;
    this.context = await browser.newContext({ viewport: size, hasTouch: size === PHONE, acceptDownloads: true });
    this.page = await this.context.newPage();
    this.page.setDefaultTimeout(PATIENCE_MS);
    this.page.on("pageerror", (error) => this.errors.push(`page: ${error.stack}`));
    this.page.on("console", (m) => m.type() === "error" && this.errors.push(`console: ${m.text()} ${m.location().url}`));
    this.page.on("request", (r) => r.method() === "POST" && this.posts.push({ path: new URL(r.url()).pathname, body: r.postDataJSON() }));
    const theme = story.theme ?? "light";
    await this.page.addInitScript((t) => localStorage.getItem("scenecast.theme") ?? localStorage.setItem("scenecast.theme", JSON.stringify(t)), theme);
    await this.page.goto(url);
    if (!story.bare) await this.ready();
  }

  async ready() {
    await this.until("the first state", () => this.page.evaluate(() => document.body.dataset.feed === "open"));
    await this.until("the map", () => this.inPage(({ store }) => !store.vehicle || store.maps.has(store.selectedId)));
  }

  /** Runs `fn` in the page with the page's own modules. */
  inPage(fn, argument) {
    return this.page.evaluate(`(async () => {
      const names = ["store", "map/chart", "map/frames", "book", "map/layers"];
      const modules = await Promise.all(names.map((m) => import("/js/" + m + ".js")));
      return (${fn})(Object.assign({}, ...modules), ${JSON.stringify(argument)});
    })()`);
  }

  /** Measures until `good`, at most five times, since others may use the machine; all that was measured, the last one first. */
  async best(good, measure) {
    const seen = [];
    for (let i = 0; i < 5 && !(seen.length > 0 && good(seen[0])); i += 1) seen.unshift(await measure());
    return seen;
  }

  async get(path) {
    const answer = await fetch(`${this.url}/api/v1${path}`);
    assert.equal(answer.status, 200, path);
    return answer.json();
  }

  post(path, body) {
    return fetch(`${this.url}/api/v1${path}`, {
      method: "POST", body: JSON.stringify(body), headers: { "x-scenecast": "1", "content-type": "application/json" },
    });
  }

  async vehicle(id) {
    const { vehicles } = await this.get("/state");
    return vehicles.find((v) => v.id === id) ?? vehicles[0];
  }

  async steer(order) {
    const answer = await fetch(`${this.url}/mock`, { method: "POST", body: JSON.stringify(order) });
    assert.equal(answer.status, 200);
    return answer.json();
  }

  /** Polls until `check` gives something true; mission time runs on meanwhile in the mock if `advance`. */
  async until(what, check, { ms = PATIENCE_MS, advance = 0 } = {}) {
    const end = performance.now() + ms;
    let last = null;
    while (performance.now() < end) {
      try {
        last = await check();
        if (last) return last;
      } catch (error) {
        last = error;
      }
      if (advance && this.mocked) await this.steer({ advance });
      await new Promise((resolve) => setTimeout(resolve, 60));
    }
    throw new Error(`waited ${ms} ms for ${what}; last saw ${last}`);
  }

  shows(selector, pattern, options) {
    const seen = async () => {
      const text = await this.page.locator(selector).first().innerText();
      return pattern.test(text.replaceAll("\u202f", " ")) && text;
    };
    return this.until(`${selector} to show ${pattern}`, seen, options);
  }

  button(name) {
    return this.page.getByRole("button", { name, exact: true });
  }

  noErrors(tolerated) {
    const bad = this.errors.filter((e) => !tolerated?.test(e));
    assert.deepEqual(bad, [], "no errors in the console");
  }

  close() {
    return this.context?.close();
  }
}
