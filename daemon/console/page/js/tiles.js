// A map of any extent in tiles of 64 x 64 cells, from the bytes of docs/reference/map-tiles.md. Columns and rows of cells and of
// tiles count from the map's origin.

export const EDGE = 64;
const MAGIC = 0x544d4353;
const FORMAT = 1;
const HALF = 2 ** 25;

/** A tile's place as one number; columns and rows have 26 bits. */
export const keyOf = (column, row) => (row + HALF) * 2 * HALF + column + HALF;

/** The known levels of one layer in a tile: a rectangle, with the time at which each was received. */
class Part {
  constructor(rectangle, times, index, levels) {
    Object.assign(this, rectangle, { times, index, levels });
  }

  /** The place of a tile's cell in the arrays, or -1. */
  at(x, y) {
    const [dx, dy] = [x - this.x, y - this.y];
    return dx >= 0 && dy >= 0 && dx < this.width && dy < this.height ? dy * this.width + dx : -1;
  }

  level(x, y) {
    const at = this.at(x, y);
    return at < 0 ? 0 : this.levels[at];
  }

  /** Mission time in seconds, or null. */
  time(x, y) {
    const at = this.at(x, y);
    return at < 0 || this.index[at] === 0 ? null : this.times[this.index[at] - 1];
  }
}

/** A tile never changes; an update of the map brings another one. */
class Tile {
  /** `parts[0]` has the labels, `parts[n]` the layer with number n. */
  constructor(column, row, parts) {
    Object.assign(this, { column, row, parts });
  }

  get labels() {
    return this.parts[0];
  }

  /** Calls `fn` with column and row in the tile and the label of each explored cell. */
  eachCell(fn) {
    const { x, y, width, height, levels } = this.labels ?? { width: 0, height: 0 };
    for (let dy = 0, at = 0; dy < height; dy += 1)
      for (let dx = 0; dx < width; dx += 1, at += 1) if (levels[at] !== 0) fn(x + dx, y + dy, levels[at]);
  }
}

/** The index and the tiles of a response. Throws if it is in another format. */
export function parseTiles(buffer) {
  const view = new DataView(buffer);
  if (view.byteLength < 12 || view.getUint32(0, true) !== MAGIC || view.getUint8(4) !== FORMAT) {
    throw new Error("the map is in an unknown format: reload the page");
  }
  const start = 12 + view.getUint32(8, true);
  const index = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 12, start - 12)));
  let at = start;
  const tiles = index.tiles.map(([column, row]) => {
    const parts = [];
    const count = view.getUint32(at, true);
    at += 4;
    for (let i = 0; i < count; i += 1) {
      const [layer, x, y, width, height, wide] = new Uint8Array(buffer, at, 6);
      const times = new Uint32Array(buffer, at + 8, view.getUint16(at + 6, true));
      at += 8 + 4 * times.length;
      const cells = width * height;
      const places = wide === 2 ? new Uint16Array(buffer, at, cells) : new Uint8Array(buffer, at, cells);
      const levels = new Uint8Array(buffer, at + wide * cells, cells);
      at += Math.ceil(((wide + 1) * cells) / 4) * 4;
      parts[layer] = new Part({ x, y, width, height }, times, places, levels);
    }
    return new Tile(column, row, parts);
  });
  return { index, tiles };
}

/** A version of a map. It shares the tiles that have not changed with the version before. */
export class TiledMap {
  /** The map after an answer of the server: added to `before` if the answer continues it, else on its own. */
  constructor({ index, tiles }, before = null) {
    const base = before && index.since !== null && index.since === before.tag ? before : null;
    const { tiles: places, layers, ...facts } = index;
    Object.assign(this, facts);
    this.tiles = new Map(base?.tiles);
    /** The coarse blocks of tiles, kept by coarse.js. */
    this.coarse = new Map(base?.coarse);
    this.layers = layers.map((l, i) => ({ ...l, number: i + 1, counts: new Uint32Array(base?.layers[i]?.counts ?? 256) }));
    for (const tile of tiles) this.#put(tile);
  }

  static empty(facts) {
    const { version, cell_m = 1 } = facts;
    return new TiledMap({ index: { tag: "", since: null, version, at_s: 0, cell_m, x0: 0, y0: 0, width: 0, height: 0, layers: [], tiles: [] }, tiles: [] });
  }

  #put(tile) {
    const key = keyOf(tile.column, tile.row);
    const old = this.tiles.get(key);
    for (const layer of this.layers) {
      for (const level of old?.parts[layer.number]?.levels ?? []) layer.counts[level] -= 1;
      for (const level of tile.parts[layer.number]?.levels ?? []) layer.counts[level] += 1;
    }
    if (tile.parts.length > 0) this.tiles.set(key, tile);
    else this.tiles.delete(key);
    for (const dy of [-1, 0, 1]) for (const dx of [-1, 0, 1]) this.coarse.delete(keyOf(tile.column + dx, tile.row + dy));
  }

  get isEmpty() {
    return this.width === 0 || this.height === 0;
  }

  tileAt(x, y) {
    return this.tiles.get(keyOf(Math.floor(x / EDGE), Math.floor(y / EDGE))) ?? null;
  }

  /** The label of the cell in column `x` and row `y`, 0 = unexplored. */
  label(x, y) {
    const tile = this.tileAt(x, y);
    return tile?.labels?.level(x - tile.column * EDGE, y - tile.row * EDGE) ?? 0;
  }

  /** Level and time of a cell in the layer with a number; 0 has the labels. */
  value(number, x, y) {
    const tile = this.tileAt(x, y);
    const part = tile?.parts[number];
    if (!part) return { level: 0, timeS: null };
    const [dx, dy] = [x - tile.column * EDGE, y - tile.row * EDGE];
    return { level: part.level(dx, dy), timeS: part.time(dx, dy) };
  }

  /** The explored cells: {x, y, label}. */
  *cells() {
    for (const tile of this.tiles.values()) {
      const found = [];
      tile.eachCell((x, y, label) => found.push({ x: tile.column * EDGE + x, y: tile.row * EDGE + y, label }));
      yield* found;
    }
  }

  /** Mission time at which the oldest cell was received, or null. */
  get oldestS() {
    if (this.oldest === undefined) {
      const times = [...this.tiles.values()].map((t) => t.labels?.times[0]).filter((t) => t !== undefined);
      this.oldest = times.reduce((a, b) => Math.min(a, b), Infinity);
    }
    return Number.isFinite(this.oldest) ? this.oldest : null;
  }
}

/** The extent of the explored cells in metres [west, south, east, north], or null. */
export function extent(map) {
  if (map.isEmpty) return null;
  const m = map.cell_m;
  return [map.x0 * m, map.y0 * m, (map.x0 + map.width) * m, (map.y0 + map.height) * m];
}
