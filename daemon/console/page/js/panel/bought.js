// What the minimum shares of the budget bring at a budget: when what waits at the vehicle will have arrived.

import { nameOf } from "../book.js";
import { bytes, count, span } from "../format.js";
import { store } from "../store.js";

/** Edge of an image of the sea floor, cells. */
const FLOOR_CELLS = 8;
/** The part of the budget that images of the sea floor take at most, and the bytes of one before any has arrived. */
const FLOOR_PART = 0.5;
const FLOOR_BYTES = 700;
const EXEMPLAR_BYTES = 500;

/** The part of the bits on air that arrives and is neither head nor check. */
function useful(vehicle) {
  const all = Object.values(store.snapshot.link.up.bytes_by_class).reduce((a, b) => a + b, 0);
  const heads = all > 0 ? (store.snapshot.link.up.bytes_by_class.overhead ?? 0) / all : 0;
  return (1 - heads) * (1 - (vehicle.link?.up.loss ?? 0));
}

/** The labels whose image was asked for and has not arrived, and the bits that are missing of all. */
function imagesToCome(vehicle) {
  const labels = vehicle.labels.filter(({ exemplar }) => ["queued", "on_air", "receiving"].includes(exemplar.state));
  const bits = labels.reduce((sum, { exemplar }) => sum + 8 * (exemplar.bytes ?? EXEMPLAR_BYTES) * (1 - exemplar.progress), 0);
  return { labels, bits };
}

/** What a share brings: words, and where there is something to wait for, the seconds at the link's present state. */
const now = (words) => ({ words, seconds: null });
const later = (words, bits, bps) => ({ words, seconds: Math.max(1, bits / bps) });

/** What the map's and the exemplars' share and the free rest bring, by class; null without a report of the vehicle. */
export function bought(vehicle, { budget_bps: budget, shares, background }) {
  const backlog = vehicle.link?.backlog;
  if (!backlog) return null;
  const bps = budget * useful(vehicle);
  const images = imagesToCome(vehicle);
  // A share that nothing waits for goes to the others.
  const waiting = { map: backlog.map_bits > 0, exemplar: images.bits > 0 };
  const busy = Object.keys(waiting).reduce((sum, c) => sum + (waiting[c] ? shares[c] : 0), 0);
  const rate = (c) => (busy > 0 ? (bps * shares[c]) / busy : bps);
  const names = images.labels.map((l) => nameOf(l.id)).join(", ");
  return {
    map: waiting.map ? later(`${bytes(backlog.map_bits / 8)} wait: current in about`, backlog.map_bits, rate("map")) : now("current by the last report"),
    exemplar: waiting.exemplar ? later(`${names}: image in about`, images.bits, rate("exemplar")) : later("an image takes about", 8 * EXEMPLAR_BYTES, bps),
    free: floor(vehicle, bps * (1 - (waiting.map ? shares.map : 0) / 100), background),
  };
}

function floor(vehicle, bps, background) {
  if (!background.includes("floor")) return now("images of the sea floor are off");
  const { images, bytes: held } = vehicle.floor;
  const squares = Math.ceil((vehicle.map?.explored_cells ?? 0) / FLOOR_CELLS ** 2);
  if (images >= squares) return now(`${count(images)} images of the sea floor`);
  const bits = 8 * (images > 0 ? held / images : FLOOR_BYTES) * (squares - images);
  return later(`${count(images)} of about ${count(squares)} images of the sea floor, all in about`, bits, FLOOR_PART * bps);
}

/** A line of text: what a share brings as it is edited, and what it brings now where that differs. */
export function broughtText(edited, present) {
  const when = ({ seconds }) => (seconds === null ? "" : Number.isFinite(seconds) ? ` ${span(seconds)}` : " no time soon");
  const differs = edited.seconds !== present.seconds && present.seconds !== null;
  return `${edited.words}${when(edited)}${differs ? `, now${when(present)}` : ""}`;
}
