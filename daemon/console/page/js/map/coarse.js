// Coarse cells. When the budget is short, a vehicle first sends every fourth cell in both directions. One such cell stands for
// a block of 4 x 4 cells, which is painted pale and is in no count, area or export. A block lies within one tile.

import { EDGE, keyOf } from "../tiles.js";

const SIDE = 4;
const PALE = 76;
const NONE = [];

/** The blocks of a tile of which only one cell was received: [{ x, y, label }], the south-west cell of each. */
export function blocksOf(map, tile) {
  const key = keyOf(tile.column, tile.row);
  if (!map.coarse.has(key)) map.coarse.set(key, search(map, tile));
  return map.coarse.get(key);
}

/** The blocks of the whole map. */
export const coarseBlocks = (map) => [...map.tiles.values()].flatMap((tile) => blocksOf(map, tile));

/** Whether the map has any such block. */
export function hasCoarse(map) {
  for (const tile of map.tiles.values()) if (blocksOf(map, tile).length > 0) return true;
  return false;
}

function search(map, tile) {
  const labels = tile.labels;
  if (!labels) return NONE;
  const sparse = [];
  for (let y = 0; y < EDGE; y += SIDE)
    for (let x = 0; x < EDGE; x += SIDE) {
      const label = labels.level(x, y);
      if (label !== 0 && aloneInTile(labels, x, y)) sparse.push({ x: tile.column * EDGE + x, y: tile.row * EDGE + y, label });
    }
  if (sparse.length === 0) return NONE;
  const is = (x, y) => map.label(x, y) !== 0;
  const alone = (x, y) => is(x, y) && aloneInBlock(is, x, y) && !besides(is, x, y);
  const near = ({ x, y }) => [[SIDE, 0], [-SIDE, 0], [0, SIDE], [0, -SIDE]].some(([dx, dy]) => alone(x + dx, y + dy));
  return sparse.filter((b) => !besides(is, b.x, b.y) || near(b));
}

const aloneInTile = (labels, x, y) => aloneInBlock((cx, cy) => labels.level(cx, cy) !== 0, x, y);

function aloneInBlock(is, x, y) {
  for (let dy = 0; dy < SIDE; dy += 1) for (let dx = dy === 0 ? 1 : 0; dx < SIDE; dx += 1) if (is(x + dx, y + dy)) return false;
  return true;
}

/** Whether a cell west or south of the block touches it: then the finely sent map may end here. */
function besides(is, x, y) {
  return [[-1, -1], [0, -1], [1, -1], [-1, 0], [-1, 1]].some(([dx, dy]) => is(x + dx, y + dy));
}

/** The block that holds the unexplored cell in column `x` and row `y`, or null. */
export function blockAt(map, x, y) {
  const corner = (v) => Math.floor(v / SIDE) * SIDE;
  const tile = map.tileAt(x, y);
  return (tile && blocksOf(map, tile).find((b) => b.x === corner(x) && b.y === corner(y))) ?? null;
}

/** Enters the blocks of a tile, painted pale, into its pixels [r, g, b, a], north up. */
export function paintBlocks(data, blocks, tile, toneOf) {
  for (const { x, y, label } of blocks) {
    const [red, green, blue, alpha] = toneOf(label);
    for (let dy = 0; dy < SIDE; dy += 1)
      for (let dx = 0; dx < SIDE; dx += 1) {
        const row = EDGE - 1 - (y - tile.row * EDGE + dy);
        data.set([red, green, blue, (PALE * alpha) / 255], 4 * (row * EDGE + x - tile.column * EDGE + dx));
      }
  }
}
