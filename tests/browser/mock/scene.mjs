// A procedural sea floor: which label lies at (x, y) metres, and how deep it is there.

function hash(x, y, seed) {
  let h = Math.imul(x, 374761393) ^ Math.imul(y, 668265263) ^ Math.imul(seed, 1274126177);
  h = Math.imul(h ^ (h >>> 13), 1274126177);
  return ((h ^ (h >>> 16)) >>> 0) / 4294967296;
}

function noise(x, y, seed) {
  const xi = Math.floor(x);
  const yi = Math.floor(y);
  const u = (x - xi) ** 2 * (3 - 2 * (x - xi));
  const v = (y - yi) ** 2 * (3 - 2 * (y - yi));
  const low = hash(xi, yi, seed) * (1 - u) + hash(xi + 1, yi, seed) * u;
  const high = hash(xi, yi + 1, seed) * (1 - u) + hash(xi + 1, yi + 1, seed) * u;
  return low * (1 - v) + high * v;
}

const fractal = (x, y, seed) =>
  0.6 * noise(x / 6, y / 6, seed) + 0.28 * noise(x / 2.2, y / 2.2, seed + 1) + 0.12 * noise(x, y, seed + 2);

/** The habitat (0..8) at a place in metres. */
export function habitat(x, y) {
  const relief = fractal(x, y, 11);
  const cover = fractal(x + 90, y - 40, 23);
  if (relief > 0.66) return cover > 0.5 ? 0 : 1;
  if (relief > 0.56) return cover > 0.55 ? 2 : 3;
  if (relief > 0.44) return cover > 0.62 ? 4 : cover > 0.38 ? 5 : 6;
  return cover > 0.6 ? 7 : 8;
}

/** Depth of the floor in metres, positive down. */
export const floorDepth = (x, y) => 22 - 7 * fractal(x, y, 11);

/** Mean surprise of a word in bits, 2 to 11: much at borders, and a few cells at random far off. */
export function surprise(x, y) {
  const odd = hash(Math.floor(4 * x), Math.floor(4 * y), 31);
  if (odd < 0.015) return odd < 0.007 ? 2.5 : 10.5;
  return Math.floor(4.2 + 4 * (1 - confidence(x, y)) + odd) + 0.5;
}

/** How sure the topic model is of the label, 0..1: low near borders. */
export function confidence(x, y) {
  const here = habitat(x, y);
  let same = 0;
  for (const [dx, dy] of [[0.5, 0], [-0.5, 0], [0, 0.5], [0, -0.5], [0.9, 0.9], [-0.9, -0.9]]) {
    same += habitat(x + dx, y + dy) === here ? 1 : 0;
  }
  return 0.25 + 0.12 * same;
}
