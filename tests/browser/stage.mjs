// The tools of a story: a new page, the API, control of the mock, and checks that wait for a condition.

import assert from "node:assert/strict";

export const WIDE = { width: 1440, height: 900 };
export const MIDDLE = { width: 1024, height: 768 };
export const PHONE = { width: 390, height: 844 };
export const API = "/api/v2";

/** The limit of each wait. A condition that holds is noticed at once, so a slow machine does not fail a story. */
const TIMEOUT_MS = 300000;
const POLL_MS = 60;
/** Time of a page whose clock is stopped: any fixed date. */
const START_MS = Date.UTC(2026, 0, 1);

/** The colours of CSS custom properties and pixels as [r, g, b]; a source text, since it runs in the page. */
const IN_PAGE = `const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).match(/[0-9a-f]{2}/gi).map((x) => parseInt(x, 16));`;

/** Reports each text on the page, and each help text of an element, that has a value of the program in it. It runs in the page. */
function watchTexts() {
  const ATTRIBUTES = ["title", "aria-label", "aria-valuetext", "placeholder"];
  const check = (value, where) => /\b(null|undefined|NaN)\b/.test(value) && window.reportProgramText(`${where}: ${value.slice(0, 120)}`);
  const look = (node) => {
    if (node.nodeType === Node.TEXT_NODE) {
      if (!node.parentElement?.closest("script, style")) check(node.data, node.parentElement?.tagName);
      return;
    }
    for (const name of ATTRIBUTES) if (node.getAttribute?.(name)) check(node.getAttribute(name), `${node.tagName} ${name}`);
    node.childNodes.forEach(look);
  };
  new MutationObserver((changes) => {
    for (const { type, target, addedNodes } of changes) {
      if (type === "childList") addedNodes.forEach(look);
      else if (type === "attributes") look(target.cloneNode(false));
      else look(target);
    }
  }).observe(document, { subtree: true, childList: true, characterData: true, attributes: true, attributeFilter: ATTRIBUTES });
}

export class Stage {
  /** Measurements of a story, for the log. */
  figures = [];

  /**
   * Opens the page; unless the story is bare, waits for the first state and map. A page of an earlier story goes on in `kept`, without its
   * storage, since a new one takes a second of the processor.
   */
  async open(browser, { url, mocked, token, limits }, story, kept) {
    Object.assign(this, { url, mocked, token, browser, limits });
    this.errors = [];
    this.texts = [];
    this.posts = [];
    this.orders = [];
    if (mocked) await this.steer({ scenario: story.scenario ?? "rich", down: false, stream: true, mute: false });
    const size = story.size ?? WIDE;
    this.isAlone = Boolean(story.stopped || story.bare) || size === PHONE;
    if (this.isAlone || !kept.page) await this.begin(size);
    else await this.goOn(kept, size);
    this.page.setDefaultTimeout(TIMEOUT_MS);
    this.page.on("pageerror", (error) => this.errors.push(`page: ${error.stack}`));
    // A document without scripts, between two stories, names no icon.
    const isOurs = (m) => m.type() === "error" && !m.location().url.endsWith("/favicon.ico");
    this.page.on("console", (m) => isOurs(m) && this.errors.push(`console: ${m.text()} ${m.location().url}`));
    this.page.on("request", (r) => {
      if (r.method() !== "POST") return;
      this.orders.push(r);
      // Drafts follow the sliders by themselves, and a dry run is no order.
      if (!/\/(draft|dry-run)$/.test(r.url())) this.posts.push({ path: new URL(r.url()).pathname, body: r.postDataJSON() });
    });
    const theme = story.theme ?? "light";
    // Command of a demo passes from story to story, which are one client.
    const stored = Object.entries({ "scenecast.theme": JSON.stringify(theme), "scenecast.client": '"story"' });
    const keep = (all) => all.forEach(([key, value]) => localStorage.getItem(key) ?? localStorage.setItem(key, value));
    await (this.isNew ? this.page.addInitScript(keep, stored) : this.page.evaluate(keep, stored));
    if (story.stopped) await this.stopClock();
    await this.page.goto(url);
    if (!story.bare) await this.ready();
  }

  async begin(size) {
    this.isNew = true;
    this.context = await this.browser.newContext({ viewport: size, hasTouch: size === PHONE, acceptDownloads: true });
    this.watched = await this.watch(this.context);
    this.page = await this.context.newPage();
  }

  /** Takes the page of an earlier story, on a document of the site that has no scripts. */
  async goOn(kept, size) {
    this.isNew = false;
    Object.assign(this, kept);
    this.watched.texts = this.texts;
    await this.page.setViewportSize(size);
    await this.page.mouse.move(0, 0);
    await this.page.goto(`${this.url}/icon.svg`);
    await this.page.evaluate(() => localStorage.clear());
  }

  /** Collects texts of a context's pages that contain a value of the program. */
  async watch(context) {
    const watched = { texts: this.texts };
    await context.exposeFunction("reportProgramText", (found) => watched.texts.push(found));
    await context.addInitScript(watchTexts);
    return watched;
  }

  /** The developer tools of the page, which no other story gets afterwards. */
  devtools() {
    this.isAlone = true;
    return this.context.newCDPSession(this.page);
  }

  /** From here on the page's clock stands still: its timers and frames run only in `tick`. */
  async stopClock() {
    await this.page.clock.install({ time: START_MS });
    await this.page.clock.pauseAt(START_MS + 1000);
  }

  /** Advances the stopped clock of the page. */
  tick(ms) {
    return this.page.clock.runFor(ms);
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
      ${IN_PAGE}
      return (${fn})(Object.assign({ ink }, ...modules), ${JSON.stringify(argument)});
    })()`);
  }

  /** Milliseconds of CPU time that the browser has spent on pages, including drawing and the network. Unlike time on a clock, it
   *  does not depend on other programs. The resolution is 10 ms. */
  async cpuMs() {
    this.processes ??= await this.browser.newBrowserCDPSession();
    const { processInfo } = await this.processes.send("SystemInfo.getProcessInfo");
    // The main process mostly serves the test.
    return 1000 * processInfo.filter((p) => p.type !== "browser").reduce((sum, p) => sum + p.cpuTime, 0);
  }

  /** Notes a time that was measured, and asserts its limit if this run asserts limits. */
  within(limit, ms, text) {
    this.figures.push(text);
    assert.ok(!this.limits || ms < limit, `${text}: over ${limit} ms`);
  }

  /** Once the server has answered every order of this page so far. */
  answered() {
    return Promise.allSettled((this.orders ?? []).map((request) => request.response()));
  }

  async get(path) {
    await this.answered();
    const response = await fetch(`${this.url}${API}${path}`);
    assert.equal(response.status, 200, path);
    return response.json();
  }

  post(path, body) {
    return fetch(`${this.url}${API}${path}`, {
      method: "POST", body: JSON.stringify(body), headers: { "x-scenecast": "1", "x-scenecast-client": "story", "content-type": "application/json" },
    });
  }

  async vehicle(id) {
    const { vehicles } = await this.get("/state");
    return vehicles.find((v) => v.id === id) ?? vehicles[0];
  }

  async steer(order) {
    await this.answered();
    const response = await fetch(`${this.url}/mock`, { method: "POST", body: JSON.stringify(order) });
    assert.equal(response.status, 200);
    return response.json();
  }

  /** Waits until `check` gives a true value, and returns it. Each time it does not, the mock's mission advances by `advance` seconds and
   *  a stopped clock of the page by `tick` milliseconds. */
  async until(condition, check, { ms = TIMEOUT_MS, advance = 0, tick = 0 } = {}) {
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
      if (tick) await this.tick(tick);
      await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    }
    throw new Error(`waited ${ms} ms for ${condition}; the last value was ${last}`);
  }

  shows(selector, pattern, options) {
    const matches = async () => {
      const text = await this.page.locator(selector).first().innerText();
      return pattern.test(text.replaceAll("\u202f", " ")) && text;
    };
    return this.until(`${selector} to show ${pattern}`, matches, options);
  }

  /** Waits until an element is visible, or hidden. */
  visible(selector, wanted = true, options) {
    return this.until(`${selector} to be ${wanted ? "visible" : "hidden"}`, async () => (await this.page.locator(selector).first().isVisible()) === wanted, options);
  }

  button(name) {
    return this.page.getByRole("button", { name, exact: true });
  }

  async noErrors(tolerated) {
    // Texts are reported in order, so all that were there before are here now.
    if (!this.page.isClosed()) await this.page.evaluate(() => 0);
    assert.deepEqual(this.texts, [], "no value of the program on the page");
    const bad = this.errors.filter((e) => !tolerated?.test(e));
    assert.deepEqual(bad, [], "no errors in the console");
  }

  /** Ends the story once the mock has answered every order: one under way would reach the mission of the next story. The page stays open for
   *  the next story if this one passed and changed nothing of the page that would last. */
  async close(kept, passed) {
    await this.answered();
    if (!passed || this.isAlone || this.page.isClosed()) {
      if (kept.context === this.context) Object.assign(kept, { context: null, page: null });
      await this.context?.close();
      return;
    }
    for (const page of this.context.pages()) if (page !== this.page) await page.close();
    await this.page.unrouteAll();
    this.page.removeAllListeners();
    await this.context.clearCookies();
    Object.assign(kept, { context: this.context, page: this.page, watched: this.watched });
  }
}
