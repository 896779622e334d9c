// The view: metres east and north <-> CSS pixels.

const MIN_SCALE = 0.02;
const MAX_SCALE = 400;

export class View {
  width = 1;
  height = 1;
  east = 0;
  north = 0;
  scale = 16;
  mode = "fit";

  resize(width, height) {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
  }

  toScreen(x, y) {
    return [this.width / 2 + (x - this.east) * this.scale, this.height / 2 - (y - this.north) * this.scale];
  }

  toWorld(px, py) {
    return [this.east + (px - this.width / 2) / this.scale, this.north - (py - this.height / 2) / this.scale];
  }

  panBy(dx, dy) {
    this.mode = "free";
    this.east -= dx / this.scale;
    this.north += dy / this.scale;
  }

  zoomAt(px, py, factor) {
    const [x, y] = this.toWorld(px, py);
    this.scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, this.scale * factor));
    if (this.mode === "follow") return;
    this.mode = "free";
    this.east = x - (px - this.width / 2) / this.scale;
    this.north = y + (py - this.height / 2) / this.scale;
  }

  centre(x, y) {
    this.east = x;
    this.north = y;
  }

  /** Shows all of [west, south, east, north], with a margin for the plates at the edges. */
  fit([west, south, east, north]) {
    const room = Math.min(56, this.width / 8);
    const across = Math.max(4, east - west);
    const up = Math.max(4, north - south);
    this.scale = Math.min((this.width - 2 * room) / across, (this.height - 2 * room) / up, 80);
    this.scale = Math.max(this.scale, MIN_SCALE);
    this.centre((west + east) / 2, (south + north) / 2);
  }

  /** Whether [west, south, east, north] lies inside the view. */
  holds([west, south, east, north]) {
    const [left, top] = this.toScreen(west, north);
    const [right, bottom] = this.toScreen(east, south);
    return left >= 0 && top >= 0 && right <= this.width && bottom <= this.height;
  }
}
