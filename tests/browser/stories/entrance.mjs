import assert from "node:assert/strict";
import { API } from "../stage.mjs";

const enter = async (s, token) => {
  await s.page.getByLabel(/Token of this surface/).fill(token);
  await s.button("Log in").click();
};

export default [
  {
    name: "the form refuses a wrong token and opens the page with the right one",
    locked: true,
    bare: true,
    async run(s) {
      assert.equal(new URL(s.page.url()).pathname, "/login");
      await enter(s, `${s.token}x`);
      await s.shows(".login", /This is not the token/);
      await enter(s, s.token);
      await s.until("the page", () => s.page.evaluate(() => document.body.dataset.feed === "open"));
      const [cookie] = await s.context.cookies();
      assert.ok(cookie.httpOnly && cookie.sameSite === "Strict" && !cookie.value.includes(s.token), "a cookie that is not the token");
      await s.page.reload();
      await s.until("the page again", () => s.page.evaluate(() => document.body.dataset.feed === "open"));
      assert.equal((await fetch(`${s.url}${API}/state`)).status, 401);
    },
    tolerates: /401/,
  },
  {
    name: "a page without a valid session opens the login form",
    locked: true,
    bare: true,
    async run(s) {
      await enter(s, s.token);
      await s.until("the page", () => s.page.evaluate(() => document.body.dataset.feed === "open"));
      await s.context.clearCookies();
      await s.page.reload();
      await s.until("the login", () => new URL(s.page.url()).pathname === "/login");
    },
    tolerates: /401/,
  },
];
