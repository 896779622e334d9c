// Numbers as text for the operator.

const DASH = "\u2013";
const THIN = "\u202f";

export const none = DASH;

/** Seconds as "8 s", "2 min 05 s", "1 h 12 min". */
export function span(s) {
  if (s === null || s === undefined || !Number.isFinite(s)) return DASH;
  const t = Math.max(0, Math.round(s));
  if (t < 100) return `${t}${THIN}s`;
  if (t < 3600) return `${Math.floor(t / 60)}${THIN}min ${String(t % 60).padStart(2, "0")}${THIN}s`;
  return `${Math.floor(t / 3600)}${THIN}h ${String(Math.floor((t % 3600) / 60)).padStart(2, "0")}${THIN}min`;
}

export const ago = (s) => (s === null ? "never" : `${span(s)} ago`);

/** Seconds as h:mm:ss. */
export function elapsed(s) {
  const t = Math.max(0, Math.floor(s));
  const two = (n) => String(n).padStart(2, "0");
  return `${Math.floor(t / 3600)}:${two(Math.floor(t / 60) % 60)}:${two(t % 60)}`;
}

/** Mission time as T+ h:mm:ss. */
export const missionTime = (s) => `T+${elapsed(s)}`;

/** Seconds since 1970 as "2026-11-29 10:15:00 UTC", or with `length` 16 without the seconds. */
export const utc = (s, length = 19) => `${new Date(1000 * s).toISOString().slice(0, length).replace("T", " ")} UTC`;

/** The name of a layer or another one of the API, for people. */
export const plain = (name) => name.replaceAll("_", " ");

export function metres(m, digits = 1) {
  if (m === null || m === undefined) return DASH;
  if (Math.abs(m) >= 1000) return `${(m / 1000).toFixed(2)}${THIN}km`;
  return `${minus(m.toFixed(digits))}${THIN}m`;
}

export function area(m2) {
  if (m2 >= 1000 && m2 < 10000) return `${count(m2)}${THIN}m²`;
  return m2 >= 10000 ? `${(m2 / 10000).toFixed(2)}${THIN}ha` : `${m2.toFixed(m2 < 10 ? 2 : 1)}${THIN}m²`;
}

export const minus = (t) => (/^-0(\.0*)?$/.test(t) ? t.slice(1) : t.replace("-", "\u2212"));

export const signed = (w) => (w > 0 ? `+${w.toFixed(2)}` : minus(w.toFixed(2)));

export const percent = (x, digits = 0) => (x === null ? DASH : `${(100 * x).toFixed(digits)}${THIN}%`);

export const degrees = (d) => `${String(Math.round(((d % 360) + 360) % 360) % 360).padStart(3, "0")}°`;

export function bits(n) {
  if (n === null || n === undefined) return DASH;
  if (n < 1000) return `${Math.round(n)}${THIN}bit`;
  if (n < 1e6) return `${(n / 1000).toFixed(n < 10000 ? 2 : 1)}${THIN}kbit`;
  return `${(n / 1e6).toFixed(2)}${THIN}Mbit`;
}

export const rate = (n) => (n === null || n === undefined ? DASH : `${bits(n)}/s`);

export function joules(j) {
  if (j === null || j === undefined) return DASH;
  if (j < 1) return `${(1000 * j).toFixed(j < 0.1 ? 2 : 0)}${THIN}mJ`;
  return j < 1e4 ? `${j.toFixed(j < 10 ? 2 : 0)}${THIN}J` : `${(j / 1000).toFixed(1)}${THIN}kJ`;
}

export function bytes(n) {
  return n < 1000 ? `${n}${THIN}B` : `${(n / 1000).toFixed(1)}${THIN}kB`;
}

/** Free space that is known as a lower bound, a power of two. */
export function freeSpace(n) {
  if (n === null) return "free space unknown";
  if (n < 1e6) return `less than 1${THIN}MB free`;
  return n < 1e9 ? `at least ${Math.floor(n / 1e6)}${THIN}MB free` : `at least ${Math.floor(n / 1e9)}${THIN}GB free`;
}

export const count = (n) => String(Math.round(n)).replace(/\B(?=(\d{3})+$)/g, THIN);

/** The largest 1, 2 or 5 times a power of ten that is not above x. */
export function nice(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  const digit = x / power;
  return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}
