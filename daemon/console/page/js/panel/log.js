// The log of the mission: orders and edits with their authors, answers, silences, new labels, images. The newest comes first.

import { BASE, readLog } from "../api.js";
import { $, fill, h, show, text } from "../dom.js";
import { missionTime } from "../format.js";
import { store } from "../store.js";

const KINDS = { order: "Orders", answer: "Answers", contact: "Contact", mode: "Modes", label: "New labels", image: "Images", record: "Names, notes, markers", command: "Command", fault: "Faults" };
/** As many as the surface keeps. */
const MAX_ENTRIES = 2000;
const MAX_SHOWN = 300;

const kind = h("select", { onchange: refresh, "aria-label": "Kind of the entries" },
  h("option", { value: "" }, "everything"), ...Object.entries(KINDS).map(([value, name]) => h("option", { value }, name)));
const words = h("input", { type: "search", placeholder: "a name or a word", "aria-label": "Text of the entries", oninput: refresh });
const list = h("ol.log", { "aria-label": "Entries, the newest first" });
const empty = h("p.hint");
const file = h("a", { download: "log.csv" }, "Download as CSV");

let entries = [];
let mission = null;
let isReading = false;

export function startLog() {
  $("log").append(h("header", {}, h("h2", { id: "log-title" }, "Log")),
    h("div.part", {}, h("div.filters", {}, kind, words), empty, list, h("p", {}, file)));
  store.on("state tab", follow);
  refresh();
}

/** Reads the entries that are new, while the log is in view. */
async function follow() {
  const { snapshot } = store;
  const isShown = document.body.dataset.tab === "log";
  if (!snapshot || !isShown || isReading) return;
  if (mission !== snapshot.mission.id) [mission, entries] = [snapshot.mission.id, []];
  const held = entries.at(-1)?.number ?? 0;
  if (snapshot.log === held) return;
  // A record was set back: the entries after its moment are not known yet.
  const last = snapshot.log < held ? 0 : held;
  isReading = true;
  try {
    const further = await readLog(last);
    entries = [...(last === 0 ? [] : entries), ...further].slice(-MAX_ENTRIES);
    refresh();
  } catch {
    // The next state reads again.
  }
  isReading = false;
  if (store.replay && store.snapshot !== snapshot) follow();
}

const authorOf = (e) => e.by ?? store.snapshot?.vehicles.find((v) => v.id === e.vehicle)?.name ?? "surface";

function isWanted(e) {
  const wanted = words.value.trim().toLowerCase();
  return (kind.value === "" || e.kind === kind.value) && `${authorOf(e)} ${e.text}`.toLowerCase().includes(wanted);
}

function refresh() {
  const found = entries.filter(isWanted).slice(-MAX_SHOWN).reverse();
  fill(list, ...found.map(row));
  show(empty, found.length === 0);
  text(empty, entries.length > 0 ? "No entry is like that." : "Orders, answers, silences, new labels and images will appear here.");
  file.href = `${BASE}/log.csv${kind.value && `?kind=${kind.value}`}`;
}

const row = (e) =>
  h("li", { data: { kind: e.kind } },
    h("time", { title: e.utc, dateTime: e.utc }, missionTime(e.at_s)), " ", h("b", {}, authorOf(e)), " ", h("span", {}, e.text));
