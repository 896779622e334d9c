// The layer "natural": each label in the mean colour of its exemplars, and from a zoom on with their texture. It is an illustration:
// a texture shows what the label looks like somewhere, not what lies at the place.

import { h } from "../dom.js";
import { shownAs, shownLabels, tintOf } from "../book.js";
import { isStale, store } from "../store.js";
import { redTone, rgb } from "../palette.js";
import { colour, current as theme } from "../theme.js";
import { EDGE } from "../tiles.js";
import { meanOf, weave } from "./texture.js";

export const NATURAL = "natural";
/** The size of a cell on the screen from which textures are drawn. */
const MIN_TEXTURE_CELL_PX = 6;
/** Pixels of an exemplar along the edge of a cell; the default of `scene.cell_m` is 25 pixels of the camera. */
const PX_PER_CELL = 25;
/** Opacity of a label without an image, and of the veil over a cell of no confidence. */
const NO_IMAGE = 100;
const FULL_VEIL = 0.7;
/** The most images that a texture is made of. */
const MAX_IMAGES = 4;
/** The pause before images that could not be loaded are requested again. */
const RETRY_MS = 10_000;

/** What a label looks like, by mission, vehicle, epoch and label: the addresses of its images, and once they are loaded their mean
 * colour and a pattern of their texture. */
const looks = new Map();
/** Counts the looks that have changed. */
export let naturalEdits = 0;

const placeOf = (vehicle, id) => `${store.snapshot.mission.id}.${vehicle.id}.${vehicle.map.epoch}.${id}`;
const lookOf = (vehicle, label) => looks.get(placeOf(vehicle, label));

/** Loads the images of a vehicle's labels that are not loaded yet. */
export function loadLooks(vehicle) {
  for (const { id, exemplar } of vehicle.labels) {
    const images = exemplar.images.slice(-MAX_IMAGES);
    const key = images.map((image) => `${image.url}?at=${image.at_s}`).join(" ");
    const known = lookOf(vehicle, id);
    // A record was set back to a moment before the first image.
    if (images.length === 0 && looks.delete(placeOf(vehicle, id))) naturalEdits += 1;
    if (images.length === 0 || known?.key === key) continue;
    // The look before is shown until the new images are loaded.
    const look = { ...known, key };
    looks.set(placeOf(vehicle, id), look);
    load(look, id);
  }
}

async function load(look, id) {
  const loaded = await Promise.allSettled(look.key.split(" ").map(pixelsOf));
  const pixels = loaded.filter((l) => l.status === "fulfilled").map((l) => l.value);
  if (pixels.length === 0) {
    setTimeout(() => (look.key = null), RETRY_MS);
    return;
  }
  look.mean = meanOf(pixels);
  const woven = weave(pixels, look.mean, id);
  const texture = canvasOf(woven.width, woven.height, (c) => c.putImageData(new ImageData(woven.data, woven.width, woven.height), 0, 0));
  look.pattern = texture.getContext("2d").createPattern(texture, "repeat");
  naturalEdits += 1;
  store.emit("natural");
}

async function pixelsOf(url) {
  const image = new Image();
  image.src = url;
  await image.decode();
  const [width, height] = [image.naturalWidth, image.naturalHeight];
  return canvasOf(width, height, (c) => c.drawImage(image, 0, 0)).getContext("2d").getImageData(0, 0, width, height);
}

function canvasOf(width, height, paint) {
  const canvas = h("canvas", { width, height });
  paint(canvas.getContext("2d", { willReadFrequently: true }));
  return canvas;
}

/** [r, g, b, a] of a shown label: the mean of its images, or its own colour, pale. */
export function naturalTone(vehicle, shown) {
  const mean = lookOf(vehicle, shown)?.mean;
  if (!mean) return [...tintOf(shown), NO_IMAGE];
  return [...(theme() === "red" ? redTone(mean) : mean), 255];
}

/** What is drawn over the tiles, kept until the look of the layer changes. */
export class NaturalOver {
  #paths = new WeakMap();
  #veils = new WeakMap();
  #sea = rgb(colour("map-sea"));

  constructor(highlight) {
    this.highlight = highlight;
  }

  /** Draws textures and veil over a tile at [x, y, side] on the screen. */
  draw(c, vehicle, map, tile, [x, y, side]) {
    // A texture looks live, and it has every colour.
    const isFlat = side / EDGE <= MIN_TEXTURE_CELL_PX || isStale(vehicle) || theme() === "red";
    if (!isFlat) this.#drawTextures(c, vehicle, tile, [x, y, side]);
    const confidence = map.layers.find((l) => l.name === "confidence");
    if (!confidence) return;
    if (!this.#veils.has(tile)) this.#veils.set(tile, veilOf(tile, confidence, this.#sea));
    c.drawImage(this.#veils.get(tile), x, y, side, side);
  }

  #drawTextures(c, vehicle, tile, [x, y, side]) {
    if (!this.#paths.has(tile)) this.#paths.set(tile, pathsOf(tile));
    c.save();
    c.translate(x, y);
    c.scale(side / EDGE, side / EDGE);
    for (const [label, path] of this.#paths.get(tile)) {
      const pattern = this.highlight === null || this.highlight === label ? lookOf(vehicle, label)?.pattern : null;
      if (!pattern) continue;
      // The texture continues from tile to tile.
      pattern.setTransform(new DOMMatrix([1 / PX_PER_CELL, 0, 0, 1 / PX_PER_CELL, -tile.column * EDGE, tile.row * EDGE]));
      c.fillStyle = pattern;
      c.fill(path);
    }
    c.restore();
  }
}

/** The cells of each shown label in a tile as a path, in cells from its north-west corner. */
function pathsOf(tile) {
  const paths = new Map();
  tile.eachCell((x, y, label) => {
    const shown = shownAs(label);
    if (!paths.has(shown)) paths.set(shown, new Path2D());
    paths.get(shown).rect(x, EDGE - 1 - y, 1, 1);
  });
  return paths;
}

/** The colour of the sea over each cell, the denser the less the scene model is confident. */
function veilOf(tile, confidence, sea) {
  const part = tile.parts[confidence.number];
  const top = confidence.lowest + confidence.edges.length - 2;
  const image = new ImageData(EDGE, EDGE);
  tile.eachCell((x, y) => {
    const level = part?.level(x, y) ?? 0;
    const share = level === 0 ? 0 : (top - level) / Math.max(1, top - confidence.lowest);
    image.data.set([...sea, 255 * FULL_VEIL * share], 4 * ((EDGE - 1 - y) * EDGE + x));
  });
  return canvasOf(EDGE, EDGE, (c) => c.putImageData(image, 0, 0));
}

/** The number of labels on the map that have no image. */
export const withoutImage = () => {
  const vehicle = store.vehicle;
  return vehicle ? shownLabels(vehicle).filter((l) => l.cells > 0 && l.exemplar.images.length === 0).length : 0;
};

/** The legend: that the layer is an illustration, and what its parts mean. */
export function naturalLegend(missing) {
  const what = "Each label is painted in the mean colour of its images and, zoomed in, with a texture woven from them. It shows what a label looks like, not what lies at each place.";
  const pale = missing === 0 ? [] : [h("span.natural-missing", {}, `pale in its own colour: no image yet (${missing === 1 ? "1 label" : `${missing} labels`})`)];
  return [h("b", { title: what }, "illustration made of images"), h("span", {}, "faded: little confidence"), ...pale];
}
