// Coarse cells. When the budget is short, a vehicle first sends every fourth cell in both directions. One such cell stands for
// a block of 4 x 4 cells, which is painted pale and is in no count, area or export.

const SIDE = 4;
const PALE = 76;
const found = new WeakMap();

/** The blocks of which only one cell was received: [{ at, x, y }], its index and south-west cell in the map's array. */
export function coarseBlocks(map) {
  if (!found.has(map)) found.set(map, search(map));
  return found.get(map);
}

function search(map) {
  const { x0, y0, width, height, labels } = map;
  const is = (x, y) => x >= 0 && y >= 0 && x < width && y < height && labels[y * width + x] !== 0;
  const first = (origin) => ((-origin % SIDE) + SIDE) % SIDE;
  const sparse = new Map();
  for (let y = first(y0); y < height; y += SIDE)
    for (let x = first(x0); x < width; x += SIDE) {
      if (is(x, y) && aloneInBlock(is, x, y)) sparse.set(`${x},${y}`, { at: y * width + x, x, y });
    }
  const lone = (b) => Boolean(b) && !besides(is, b);
  const near = (b) => [[SIDE, 0], [-SIDE, 0], [0, SIDE], [0, -SIDE]].some(([dx, dy]) => lone(sparse.get(`${b.x + dx},${b.y + dy}`)));
  return [...sparse.values()].filter((b) => lone(b) || near(b));
}

function aloneInBlock(is, x, y) {
  for (let dy = 0; dy < SIDE; dy += 1) for (let dx = dy === 0 ? 1 : 0; dx < SIDE; dx += 1) if (is(x + dx, y + dy)) return false;
  return true;
}

/** Whether a cell west or south of the block touches it: then the finely sent map may end here. */
function besides(is, { x, y }) {
  return [[-1, -1], [0, -1], [1, -1], [-1, 0], [-1, 1]].some(([dx, dy]) => is(x + dx, y + dy));
}

/** The block that holds the unexplored cell (x, y) of the map's array, or null. */
export function blockAt(map, x, y) {
  const corner = (v, origin) => Math.floor((v + origin) / SIDE) * SIDE - origin;
  const [bx, by] = [corner(x, map.x0), corner(y, map.y0)];
  return coarseBlocks(map).find((b) => b.x === bx && b.y === by) ?? null;
}

/** The blocks painted pale, a pixel a cell, north up, SIDE - 1 cells wider and higher than the map; null if there are none. */
export function paintCoarse(map, toneOf) {
  const blocks = coarseBlocks(map);
  if (blocks.length === 0) return null;
  const canvas = document.createElement("canvas");
  canvas.width = map.width + SIDE - 1;
  canvas.height = map.height + SIDE - 1;
  const c = canvas.getContext("2d");
  for (const { at, x, y } of blocks) {
    const [red, green, blue, alpha] = toneOf(map.labels[at]);
    c.fillStyle = `rgb(${Math.round(red)} ${Math.round(green)} ${Math.round(blue)} / ${(PALE * alpha) / 65025})`;
    c.fillRect(x, canvas.height - SIDE - y, SIDE, SIDE);
  }
  return canvas;
}

/** Metres by which the painted blocks reach beyond the map to the north and the east. */
export const overhang = (map) => (SIDE - 1) * map.cell_m;
