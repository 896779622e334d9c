// The true classes of a simulated sea floor, drawn instead of the map. No vehicle knows them.

import { h } from "../dom.js";
import { store } from "../store.js";
import { BASE } from "../api.js";
import { redShade, redTone, rgb } from "../palette.js";
import { current as theme } from "../theme.js";

export const TRUTH = "truth";
let picture = null;
/** The mission of the picture. */
let pictured = null;
/** The picture in shades of red, once it was shown so. */
let reddened = null;

/** The outline and the classes, or null where the true classes are not known. */
export const truthInfo = () => store.snapshot?.truth ?? null;

/** The picture of the classes once it is loaded, or null. Calls `loaded` when it is. */
function pictureOf(loaded) {
  const mission = store.snapshot.mission.id;
  if (!picture || pictured !== mission) {
    pictured = mission;
    reddened = null;
    picture = new Image();
    picture.onload = loaded;
    picture.onerror = () => (picture = null);
    picture.src = `${BASE}/truth.png?mission=${encodeURIComponent(mission)}`;
  }
  return picture.complete && picture.naturalWidth > 0 ? picture : null;
}

/** The colour of a class in the theme, [r, g, b]. */
const toneOf = ({ value, colour }) => (theme() === "red" ? redShade(value) : rgb(colour));

/** A canvas with the picture in shades of red, since the red theme keeps eyes adapted to the dark. */
function redden(image, classes) {
  const canvas = h("canvas", { width: image.naturalWidth, height: image.naturalHeight });
  const c = canvas.getContext("2d");
  c.drawImage(image, 0, 0);
  const pixels = c.getImageData(0, 0, canvas.width, canvas.height);
  const shades = new Map(classes.map((item) => [rgb(item.colour).join(), toneOf(item)]));
  for (let at = 0; at < pixels.data.length; at += 4) {
    const tone = [...pixels.data.subarray(at, at + 3)];
    pixels.data.set(shades.get(tone.join()) ?? redTone(tone), at);
  }
  c.putImageData(pixels, 0, 0);
  return canvas;
}

/** Draws the classes in the world frame; calls `loaded` when the picture has arrived after this. */
export function drawTruth(c, view, loaded) {
  const info = truthInfo();
  const image = info && pictureOf(loaded);
  if (!image) return;
  const [west, north] = view.toScreen(info.west_m, info.north_m);
  const [east, south] = view.toScreen(info.east_m, info.south_m);
  c.imageSmoothingEnabled = east - west < image.naturalWidth;
  if (theme() === "red") reddened ??= redden(image, info.classes);
  c.drawImage(theme() === "red" ? reddened : image, west, north, east - west, south - north);
}

/** The legend: that these are the true classes, and the colour of each. */
export function truthLegend() {
  const chip = (item) => {
    const square = h("i.truth-chip", { "aria-hidden": "true" });
    square.style.background = `rgb(${toneOf(item).join(" ")})`;
    return h("span.truth-class", {}, square, item.name);
  };
  const what = "The classes of the simulated sea floor. The vehicle does not know them, and the numbers of its labels have no relation to them.";
  return [h("b", { title: what }, "true sea floor"), ...truthInfo().classes.map(chip)];
}
