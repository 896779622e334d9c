// A growing label grid in tiles, with the second in which each cell was last received, and its bytes for the page.

const EDGE = 64;
const CELLS = EDGE * EDGE;
let runs = 0;

export class Grid {
  constructor(cellM) {
    this.cellM = cellM;
    this.tiles = new Map();
    this.size = 0;
    this.version = 0;
    this.box = null;
    this.labels = new Map();
    this.layers = "";
    /** Labels that another one replaced, the newest first. */
    this.former = [];
    this.run = (runs += 1);
  }

  tile(column, row) {
    const key = `${column},${row}`;
    if (!this.tiles.has(key)) this.tiles.set(key, { column, row, labels: new Uint8Array(CELLS), times: new Uint32Array(CELLS), changed: 0 });
    return this.tiles.get(key);
  }

  set(x, y, label, atS) {
    const tile = this.tile(Math.floor(x / EDGE), Math.floor(y / EDGE));
    const at = (y - tile.row * EDGE) * EDGE + x - tile.column * EDGE;
    const old = tile.labels[at];
    if (old !== 0 && old !== label) this.former.unshift({ x, y, label: old, until_s: atS });
    tile.labels[at] = label;
    tile.times[at] = Math.floor(atS);
    // The version is counted when all cells of a frame are here.
    tile.changed = this.version + 1;
    this.size += old === 0 ? 1 : 0;
    if (old !== 0) this.labels.set(old, this.labels.get(old) - 1);
    this.labels.set(label, (this.labels.get(label) ?? 0) + 1);
    const [x0, y0, x1, y1] = this.box ?? [x, y, x, y];
    this.box = [Math.min(x0, x), Math.min(y0, y), Math.max(x1, x), Math.max(y1, y)];
  }

  /** The label of a cell, 0 = unexplored. */
  label(x, y) {
    const tile = this.tiles.get(`${Math.floor(x / EDGE)},${Math.floor(y / EDGE)}`);
    return tile ? tile.labels[(y - tile.row * EDGE) * EDGE + x - tile.column * EDGE] : 0;
  }

  /** Calls `fn(x, y, label)` for each explored cell. */
  each(fn) {
    for (const { column, row, labels } of this.tiles.values()) {
      labels.forEach((label, at) => label !== 0 && fn(column * EDGE + (at % EDGE), row * EDGE + Math.floor(at / EDGE), label));
    }
  }

  bounds() {
    const [x0, y0, x1, y1] = this.box ?? [0, 0, -1, -1];
    return { x0, y0, width: x1 - x0 + 1, height: y1 - y0 + 1 };
  }

  counts() {
    return new Map([...this.labels].filter(([, cells]) => cells > 0));
  }

  /** The body of GET /vehicles/{id}/map/tiles; `layers` are those that the vehicle sends. */
  bytes(nowS, layers, since) {
    const names = layers.map((l) => l.name).join();
    if (names !== this.layers) Object.assign(this, { layers: names, run: (runs += 1) });
    const run = this.run.toString(16).padStart(8, "0");
    const [ofRun, revision] = (since ?? "").split("-");
    const held = ofRun === run && Number(revision) <= this.version ? Number(revision) : null;
    const changed = [...this.tiles.values()].filter((t) => held === null || t.changed > held);
    const index = {
      tag: `${run}-${this.version}`, since: held === null ? null : since, version: this.version, at_s: nowS, cell_m: this.cellM, ...this.bounds(),
      layers: layers.map(({ name, unit, is_depth, palette, spread, edges }) => ({ name, unit, is_depth, palette, spread, lowest: 1, edges })),
      tiles: changed.map((t) => [t.column, t.row]),
    };
    const json = JSON.stringify(index);
    const text = Buffer.from(json.padEnd(Math.ceil(Buffer.byteLength(json) / 4) * 4));
    const head = Buffer.alloc(12);
    head.write("SCMT\u0001", "latin1");
    head.writeUInt32LE(text.length, 8);
    return Buffer.concat([head, text, ...changed.flatMap((t) => this.tileBytes(t, layers))]);
  }

  tileBytes(tile, layers) {
    const parts = [part(0, tile, (at) => tile.labels[at])];
    layers.forEach((l, i) => parts.push(part(i + 1, tile, (at) => (tile.labels[at] === 0 ? 0 : this.levelOf(l, tile, at)))));
    const count = Buffer.alloc(4);
    count.writeUInt32LE(parts.length);
    return [count, ...parts];
  }

  levelOf(layer, tile, at) {
    const centre = (first, n) => (first * EDGE + n + 0.5) * this.cellM;
    const value = layer.at(centre(tile.column, at % EDGE), centre(tile.row, Math.floor(at / EDGE)));
    return Math.max(1, layer.edges.slice(0, -1).findLastIndex((edge) => edge <= value) + 1);
  }
}

/** The whole square of a tile as one layer's part; times of at most 65535 different seconds. */
function part(number, tile, levelAt) {
  const times = [...new Set(tile.times.filter((_, at) => tile.labels[at] !== 0))].sort((a, b) => a - b);
  const places = new Map(times.map((t, i) => [t, i + 1]));
  const wide = times.length > 255 ? 2 : 1;
  const start = 8 + 4 * times.length;
  const bytes = Buffer.alloc(Math.ceil((start + (wide + 1) * CELLS) / 4) * 4);
  bytes.set([number, 0, 0, EDGE, EDGE, wide]);
  bytes.writeUInt16LE(times.length, 6);
  times.forEach((t, i) => bytes.writeUInt32LE(t, 8 + 4 * i));
  for (let at = 0; at < CELLS; at += 1) {
    const place = tile.labels[at] === 0 ? 0 : places.get(tile.times[at]);
    if (wide === 2) bytes.writeUInt16LE(place, start + 2 * at);
    else bytes[start + at] = place;
    bytes[start + wide * CELLS + at] = levelAt(at);
  }
  return bytes;
}
