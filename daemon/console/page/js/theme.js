// Themes: day, night, and red, which keeps eyes adapted to the dark.

import { $ } from "./dom.js";
import { recall, remember } from "./prefs.js";

const NAMES = { light: "Day", dark: "Night", red: "Red" };
const ORDER = ["light", "dark", "red"];
const listeners = new Set();

export const onTheme = (fn) => listeners.add(fn);

/** The value of a custom property, for canvases. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export function startTheme() {
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  apply(recall("theme", dark ? "dark" : "light"));
  $("theme").addEventListener("click", () => {
    const next = ORDER[(ORDER.indexOf(current()) + 1) % ORDER.length];
    remember("theme", next);
    apply(next);
  });
}

export const current = () => document.documentElement.dataset.theme;

function apply(name) {
  document.documentElement.dataset.theme = ORDER.includes(name) ? name : "light";
  const button = $("theme");
  button.textContent = NAMES[current()];
  button.setAttribute("aria-label", `Theme: ${NAMES[current()]}. Change`);
  for (const fn of listeners) fn();
}
