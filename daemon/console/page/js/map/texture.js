// A seamless texture from a few images of one kind of sea floor, and their mean colour.

/** Edge of a texture. */
export const TEXTURE_PX = 256;
/** Edge of a patch as a share of the smallest image, so that patches of one image differ. */
const PATCH_SHARE = 0.55;
/** Patches that lie over each other along an edge. */
const OVERLAP = 2.5;

/** A generator of numbers in 0..1 that depends on `seed` alone (mulberry32). */
function randomFrom(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** The mean [r, g, b] of images {width, height, data} as canvases give them. */
export function meanOf(images) {
  const sum = [0, 0, 0];
  let count = 0;
  for (const { data } of images) {
    for (let i = 0; i < data.length; i += 4) for (let c = 0; c < 3; c += 1) sum[c] += data[i + c];
    count += data.length / 4;
  }
  return sum.map((s) => s / Math.max(1, count));
}

/** A texture {width, height, data} that continues itself at its edges. Patches of the images lie scattered over it; where they
 * overlap, their deviations from the mean are added so that the contrast stays (Heitz and Neyret 2018, eq. 4). */
export function weave(images, mean, seed) {
  const random = randomFrom(seed);
  const edge = Math.max(1, Math.floor(PATCH_SHARE * Math.min(TEXTURE_PX, ...images.flatMap(({ width, height }) => [width, height]))));
  const across = Math.ceil((OVERLAP * TEXTURE_PX) / edge);
  const sums = new Float32Array(3 * TEXTURE_PX ** 2);
  const squares = new Float32Array(TEXTURE_PX ** 2);
  for (let n = 0; n < across * across; n += 1) {
    const at = [n % across, Math.floor(n / across)].map((i) => Math.floor(((i + random()) * TEXTURE_PX) / across));
    lay(images[Math.floor(random() * images.length)], edge, at, mean, random, sums, squares);
  }
  const data = new Uint8ClampedArray(4 * TEXTURE_PX ** 2);
  for (let i = 0; i < squares.length; i += 1) {
    const norm = Math.sqrt(squares[i] || 1);
    for (let c = 0; c < 3; c += 1) data[4 * i + c] = mean[c] + sums[3 * i + c] / norm;
    data[4 * i + 3] = 255;
  }
  return { width: TEXTURE_PX, height: TEXTURE_PX, data };
}

/** Adds a random, perhaps mirrored, square of an image, which fades out towards its border. */
function lay({ width, height, data }, edge, [left, top], mean, random, sums, squares) {
  const [x0, y0] = [width, height].map((side) => Math.floor(random() * (side - edge + 1)));
  const isMirrored = random() < 0.5;
  const weights = Array.from({ length: edge }, (_, i) => Math.sin((Math.PI * (i + 0.5)) / edge) ** 2);
  for (let y = 0; y < edge; y += 1) {
    const row = ((top + y) % TEXTURE_PX) * TEXTURE_PX;
    for (let x = 0; x < edge; x += 1) {
      const from = 4 * ((y0 + y) * width + x0 + (isMirrored ? edge - 1 - x : x));
      const to = row + ((left + x) % TEXTURE_PX);
      const weight = weights[x] * weights[y];
      squares[to] += weight * weight;
      for (let c = 0; c < 3; c += 1) sums[3 * to + c] += weight * (data[from + c] - mean[c]);
    }
  }
}
