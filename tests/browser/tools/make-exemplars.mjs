// Paints the six small stand-in pictures of mock/exemplars/ with the browser's own WebP encoder.

import { chromium } from "playwright-core";
import { writeFile } from "node:fs/promises";
import { LAUNCH } from "../browser.mjs";

const browser = await chromium.launch(LAUNCH);
const page = await browser.newPage();
for (let kind = 0; kind < 6; kind += 1) {
  const url = await page.evaluate((k) => {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 64;
    const c = canvas.getContext("2d");
    let seed = 17 * (k + 1);
    const random = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
    const hues = [28, 42, 190, 95, 330, 215];
    c.fillStyle = `hsl(${190 + 6 * k} 30% ${26 + 4 * k}%)`;
    c.fillRect(0, 0, 64, 64);
    for (let i = 0; i < 90; i += 1) {
      c.fillStyle = `hsl(${hues[k] + 24 * random()} ${20 + 40 * random()}% ${25 + 40 * random()}% / 0.55)`;
      c.beginPath();
      c.ellipse(64 * random(), 64 * random(), 1 + 7 * random(), 1 + (k % 3) * 3 * random() + 1, 3 * random(), 0, 7);
      c.fill();
    }
    return canvas.toDataURL("image/webp", 0.5);
  }, kind);
  await writeFile(new URL(`../mock/exemplars/${kind}.webp`, import.meta.url), Buffer.from(url.split(",")[1], "base64"));
}
await browser.close();
