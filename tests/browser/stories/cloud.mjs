import assert from "node:assert/strict";

export default [
  {
    name: "the 3-D view shows the cells, or says that there is no WebGL",
    async run(s) {
      await s.page.evaluate(() => {
        const plain = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function context(kind, options) {
          return plain.call(this, kind, kind === "webgl" ? { ...options, preserveDrawingBuffer: true } : options);
        };
      });
      await s.button("3-D").click();
      const note = await s.shows("#cloud-note", /Grid|no WebGL/);
      if (/WebGL/.test(note)) return console.log(`      ${note}`);
      const shades = await s.until("points", () => s.page.evaluate(() => {
        const gl = document.getElementById("cloud").getContext("webgl");
        const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
        const data = new Uint8Array(w * h * 4);
        gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, data);
        const seen = new Set();
        for (let i = 0; i < data.length; i += 64) seen.add(`${data[i]},${data[i + 1]},${data[i + 2]}`);
        return seen.size > 3 && seen.size;
      }));
      assert.ok(shades > 3);
      await s.page.locator("#cloud").focus();
      await s.page.keyboard.press("ArrowLeft");
      await s.button("3-D").click();
      assert.equal(await s.page.locator("#cloud").isVisible(), false);
    },
    tolerates: /GL Driver|WebGL/,
  },
];
