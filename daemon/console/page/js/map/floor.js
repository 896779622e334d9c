// The layer "floor": images of the sea floor itself, each at its place, on the cells of the map. Where none has arrived, the labels are
// pale.

import { readFloor } from "../api.js";
import { tintOf } from "../book.js";
import { h } from "../dom.js";
import { ago } from "../format.js";
import { isStale, store } from "../store.js";
import { current as theme } from "../theme.js";
import { EDGE } from "../tiles.js";

export const FLOOR = "floor";
/** Opacity of a label without an image. */
const NO_IMAGE = 70;
/** The pause before images that could not be loaded are requested again. */
const RETRY_MS = 10_000;

/** What has arrived, by mission and vehicle: the number of the last image, and all of them by the tile of the map that has their middle. */
const floors = new Map();

const floorOf = (vehicle) => floors.get(`${store.snapshot.mission.id}.${vehicle.id}`);
const isHere = (vehicle) => (vehicle?.floor?.images ?? 0) > 0;

/** Whether an image of the sea floor has arrived from the chosen vehicle. */
export const hasFloor = () => isHere(store.vehicle);

/** Loads the images that have arrived since the last call. */
export function loadFloor(vehicle, map) {
  const key = `${store.snapshot.mission.id}.${vehicle.id}`;
  const { images, version, epoch } = vehicle.floor ?? { images: 0 };
  const known = floors.get(key);
  // Another map, an earlier moment of a record, or images that the surface has dropped.
  const isAnother = !known || known.epoch !== epoch || version < known.version || images < known.count;
  if (isAnother) floors.delete(key);
  if (images === 0) return;
  const floor = isAnother ? { epoch, version: 0, count: 0, tiles: new Map(), newestS: null, isBusy: false } : known;
  floors.set(key, floor);
  if (floor.isBusy || floor.version >= version) return;
  floor.isBusy = true;
  load(floor, vehicle.id, EDGE * map.cell_m).then(() => (floor.isBusy = false), () => setTimeout(() => (floor.isBusy = false), RETRY_MS));
}

async function load(floor, id, sideM) {
  const list = await readFloor(id, floor.version);
  const loaded = await Promise.allSettled(list.images.map(async (info) => {
    const picture = new Image();
    picture.src = info.url;
    await picture.decode();
    const [tile, place] = [[info.x_m, info.y_m].map((m) => Math.floor(m / sideM)).join(), `${info.x_m},${info.y_m}`];
    if (!floor.tiles.has(tile)) floor.tiles.set(tile, new Map());
    if (!floor.tiles.get(tile).has(place)) floor.count += 1;
    floor.tiles.get(tile).set(place, { ...info, picture });
    floor.newestS = Math.max(floor.newestS ?? 0, info.at_s);
  }));
  store.emit("natural");
  // The list is read again from where it was.
  if (loaded.some((one) => one.status === "rejected")) throw new Error("an image of the sea floor could not be loaded");
  floor.version = list.version;
}

/** [r, g, b, a] of a label under the images. */
export const floorTone = (shown) => [...tintOf(shown), NO_IMAGE];

/** Draws the images over the tiles of a map. */
export class FloorOver {
  #paths = new WeakMap();

  /** Draws those of a tile at [x, y, side] on the screen. */
  draw(c, vehicle, map, tile, [x, y, side]) {
    const images = floorOf(vehicle)?.tiles.get(`${tile.column},${tile.row}`);
    // The images have every colour, and the red theme has one.
    if (!images || theme() === "red") return;
    const sideM = EDGE * map.cell_m;
    const scale = side / sideM;
    c.save();
    c.translate(x, y);
    c.scale(side / EDGE, side / EDGE);
    if (!this.#paths.has(tile)) this.#paths.set(tile, pathOf(tile));
    c.clip(this.#paths.get(tile));
    c.scale(EDGE / side, EDGE / side);
    c.imageSmoothingEnabled = true;
    if (isStale(vehicle)) c.filter = "grayscale(1)";
    for (const { x_m, y_m, width_m, picture } of images.values()) {
      const left = (x_m - width_m / 2 - tile.column * sideM) * scale;
      const top = ((tile.row + 1) * sideM - y_m - width_m / 2) * scale;
      c.drawImage(picture, left, top, width_m * scale, width_m * scale);
    }
    c.restore();
  }
}

/** The known cells of a tile as a path, in cells from its north-west corner. */
function pathOf(tile) {
  const path = new Path2D();
  tile.eachCell((x, y) => path.rect(x, EDGE - 1 - y, 1, 1));
  return path;
}

/** Changes with the words of the legend. */
export const floorKey = () => `${store.vehicle?.floor?.images}.${Math.floor(store.nowS / 5)}`;

/** The legend: what the images are, and how old the newest is. */
export function floorLegend() {
  const vehicle = store.vehicle;
  const newestS = vehicle ? floorOf(vehicle)?.newestS ?? null : null;
  const what = "Images of the sea floor itself, put together on board from camera frames and sent with spare capacity: all of it coarse first, then fine. Where none has arrived, the label is pale.";
  const age = newestS === null ? [] : [h("span", {}, `the newest arrived ${ago(store.nowS - newestS)}`)];
  return [h("b", { title: what }, "images of the sea floor"), ...age, h("span", {}, "pale: no image yet")];
}
