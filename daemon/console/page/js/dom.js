// Making and updating elements without markup strings.

/** h("button.primary", {type: "button", onclick}, "Send") */
export function h(spec, props = {}, ...children) {
  const [tag, ...classes] = spec.split(".");
  const node = document.createElement(tag);
  if (classes.length > 0) node.className = classes.join(" ");
  for (const [key, value] of Object.entries(props)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (key === "data") Object.assign(node.dataset, value);
    else if (key.includes("-") || key === "role" || key === "for") node.setAttribute(key, value);
    else node[key] = value;
  }
  fill(node, ...children);
  return node;
}

/** Replaces the children of a node; null and undefined stand for no child. */
export function fill(node, ...children) {
  node.replaceChildren(...children.filter((c) => c !== null && c !== undefined));
}

export const $ = (id) => document.getElementById(id);

/** Sets text only when it differs, so that selections persist and screen readers stay quiet. */
export function text(node, value) {
  if (node.textContent !== value) node.textContent = value;
}

export function data(node, key, value) {
  if (node.dataset[key] !== value) node.dataset[key] = value;
}

export function show(node, visible) {
  if (node.hidden === visible) node.hidden = !visible;
}

const MAX_ANNOUNCED = 20;
const BURST_MS = 2000;

/** Announces `message` once to screen readers; values that change each second are not announced. Each announcement is a line of
 * its own, so that none replaces one that is not spoken yet; equal ones in a burst are one. */
export function announce(message) {
  const list = $("announce");
  const last = list.lastElementChild;
  if (last?.textContent === message && performance.now() - Number(last.dataset.at) < BURST_MS) return;
  list.append(h("span", { data: { at: performance.now() } }, message));
  while (list.childElementCount > MAX_ANNOUNCED) list.firstElementChild.remove();
}

/** Keeps one child per key in `list`, in the order of `items`; `make` builds, `update` refreshes. */
export function keyed(list, items, key, make, update) {
  const old = new Map([...list.children].map((c) => [c.dataset.key, c]));
  let at = list.firstElementChild;
  for (const item of items) {
    const k = String(key(item));
    let node = old.get(k);
    if (!node) {
      node = make(item);
      node.dataset.key = k;
    }
    old.delete(k);
    if (node === at) at = at.nextElementSibling;
    else list.insertBefore(node, at);
    update(node, item);
  }
  for (const gone of old.values()) gone.remove();
}

/** A definition row and the function that sets its value. */
export function row(name, title = "") {
  const value = h("dd");
  const line = h("div", { title }, h("dt", {}, name), value);
  return [line, (v) => text(value, v)];
}
