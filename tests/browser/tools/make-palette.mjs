// Prints the 254 label colours of daemon/console/page/js/palette-table.js.
//
// The first seven are the set of Okabe and Ito (2008). Every next colour is the sRGB candidate
// farthest, in OKLab, from all earlier ones and from the two sea colours, where the distance is the
// smallest over normal sight, protanopia, deuteranopia and tritanopia (matrices of Machado et al. 2009).
// Ids never change colour: the order is the order of choice.

const OKABE_ITO = ["e69f00", "56b4e9", "009e73", "f0e442", "0072b2", "d55e00", "cc79a7"];
const BACKGROUNDS = ["e3e8ec", "0e0d0c", "ffffff"];
const SIGHT = [
  [1, 0, 0, 0, 1, 0, 0, 0, 1],
  [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998],
  [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.01182, 0.04294, 0.968881],
  [1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.3039],
];

const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const clamp = (v) => Math.min(1, Math.max(0, v));
const parse = (hex) => [0, 2, 4].map((i) => linear(parseInt(hex.slice(i, i + 2), 16) / 255));

function oklab([r, g, b]) {
  const l = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const m = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const s = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}

function seen(rgb) {
  return SIGHT.map((m) =>
    oklab([0, 3, 6].map((r) => clamp(m[r] * rgb[0] + m[r + 1] * rgb[1] + m[r + 2] * rgb[2]))),
  );
}

function distance(a, b) {
  let least = Infinity;
  for (let i = 0; i < a.length; i += 1) {
    least = Math.min(least, Math.hypot(a[i][0] - b[i][0], a[i][1] - b[i][1], a[i][2] - b[i][2]));
  }
  return least;
}

const candidates = [];
const step = 15;
for (let r = 0; r <= 255; r += step)
  for (let g = 0; g <= 255; g += step)
    for (let b = 0; b <= 255; b += step) {
      const hex = [r, g, b].map((v) => v.toString(16).padStart(2, "0")).join("");
      const views = seen(parse(hex));
      if (views[0][0] > 0.45 && views[0][0] < 0.92) candidates.push({ hex, views, least: Infinity });
    }

const chosen = [];
function take(hex, keep) {
  const views = seen(parse(hex));
  for (const c of candidates) c.least = Math.min(c.least, distance(c.views, views));
  if (keep) chosen.push(hex);
}

for (const hex of BACKGROUNDS) take(hex, false);
for (const hex of OKABE_ITO) take(hex, true);
while (chosen.length < 254) take(candidates.reduce((a, b) => (b.least > a.least ? b : a)).hex, true);

console.log("// Made by tests/browser/tools/make-palette.mjs; label id 1 comes first.");
console.log("export const TABLE = (");
for (let i = 0; i < 254; i += 12) {
  console.log(`  "${chosen.slice(i, i + 12).join("")}"${i + 12 < 254 ? " +" : ""}`);
}
console.log(");");
