// The true classes of a simulated sea floor, drawn instead of the map. No vehicle knows them.

import { h } from "../dom.js";
import { store } from "../store.js";
import { BASE } from "../api.js";

export const TRUTH = "truth";
let picture = null;
/** The mission of the picture. */
let pictured = null;

/** The outline and the classes, or null where the true classes are not known. */
export const truthInfo = () => store.snapshot?.truth ?? null;

/** The picture of the classes once it is loaded, or null. Calls `loaded` when it is. */
function pictureOf(loaded) {
  const mission = store.snapshot.mission.id;
  if (!picture || pictured !== mission) {
    pictured = mission;
    picture = new Image();
    picture.onload = loaded;
    picture.onerror = () => (picture = null);
    picture.src = `${BASE}/truth.png?mission=${encodeURIComponent(mission)}`;
  }
  return picture.complete && picture.naturalWidth > 0 ? picture : null;
}

/** Draws the classes in the world frame; calls `loaded` when the picture has arrived after this. */
export function drawTruth(c, view, loaded) {
  const info = truthInfo();
  const image = info && pictureOf(loaded);
  if (!image) return;
  const [west, north] = view.toScreen(info.west_m, info.north_m);
  const [east, south] = view.toScreen(info.east_m, info.south_m);
  c.imageSmoothingEnabled = east - west < image.naturalWidth;
  c.drawImage(image, west, north, east - west, south - north);
}

/** The legend: that these are the true classes, and the colour of each. */
export function truthLegend() {
  const chip = ({ name, colour }) => {
    const square = h("i.truth-chip", { "aria-hidden": "true" });
    square.style.background = colour;
    return h("span.truth-class", {}, square, name);
  };
  const what = "The classes of the simulated sea floor. The vehicle does not know them, and the numbers of its labels have no relation to them.";
  return [h("b", { title: what }, "true sea floor"), ...truthInfo().classes.map(chip)];
}
