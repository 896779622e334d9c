import assert from "node:assert/strict";

const enter = async (s, token) => {
  await s.page.getByLabel(/Token of this surface/).fill(token);
  await s.button("Log in").click();
};

export default [
  {
    name: "who has no token is asked for it, a wrong one is refused, the right one opens the page and is remembered",
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
      assert.equal((await fetch(`${s.url}/api/v1/state`)).status, 401);
    },
    tolerates: /401/,
  },
  {
    name: "a page whose session the surface has forgotten goes to the login by itself",
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
