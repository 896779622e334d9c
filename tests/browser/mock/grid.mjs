// A growing label grid with the second in which each cell was last received.

export class Grid {
  constructor(cellM) {
    this.cellM = cellM;
    this.cells = new Map();
    this.version = 0;
  }

  set(x, y, label, atS) {
    this.cells.set(`${x},${y}`, { x, y, label, atS });
  }

  bounds() {
    let [x0, y0, x1, y1] = [0, 0, -1, -1];
    if (this.cells.size > 0) [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const c of this.cells.values()) {
      x0 = Math.min(x0, c.x);
      y0 = Math.min(y0, c.y);
      x1 = Math.max(x1, c.x);
      y1 = Math.max(y1, c.y);
    }
    return { x0, y0, width: x1 - x0 + 1, height: y1 - y0 + 1 };
  }

  counts() {
    const counts = new Map();
    for (const c of this.cells.values()) counts.set(c.label, (counts.get(c.label) ?? 0) + 1);
    return counts;
  }

  /** The body of GET /vehicles/{id}/map; `layers` are those that the vehicle sends. */
  json(nowS, layers) {
    const { x0, y0, width, height } = this.bounds();
    const labels = Buffer.alloc(width * height);
    const ages = Buffer.alloc(width * height * 2, 0xff);
    const extra = layers.map((p) => ({ ...p, bytes: Buffer.alloc(width * height) }));
    for (const c of this.cells.values()) {
      const at = (c.y - y0) * width + (c.x - x0);
      labels[at] = c.label;
      ages.writeUInt16LE(Math.min(65534, Math.max(0, Math.round(nowS - c.atS))), at * 2);
      for (const p of extra) {
        const value = p.at((c.x + 0.5) * this.cellM, (c.y + 0.5) * this.cellM);
        p.bytes[at] = Math.max(1, p.edges.slice(0, -1).findLastIndex((edge) => edge <= value) + 1);
      }
    }
    const map = { version: this.version, x0, y0, width, height, cell_m: this.cellM };
    map.labels = labels.toString("base64");
    map.age_s = ages.toString("base64");
    map.layers = extra.map((p) => ({
      name: p.name, unit: p.unit, palette: p.palette, spread: p.spread, is_depth: p.is_depth,
      lowest: 1, edges: p.edges,
      data: p.bytes.toString("base64"), age_s: map.age_s,
    }));
    return map;
  }
}
