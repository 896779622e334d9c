// Pan and zoom by mouse, fingers and keys.

const KEY_PAN_PX = 60;

/** Listens on `canvas`. Calls `changed()` after the view moved, `point(px, py | null)` when the pointer moves and
 *  `click(px, py)` for a press that did not pan. `grab(px, py)` returns the handlers of a press that does not pan,
 *  {move(px, py), press()}, or null. `keys` override the keys of this module; "Shift+ArrowLeft" is a key with shift. */
export function listen(canvas, view, { changed, point, click, grab, keys }) {
  const fingers = new Map();
  let moved = 0;
  let held = null;

  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, place(event));
    moved = fingers.size > 1 ? Infinity : 0;
    held = fingers.size > 1 || event.button > 0 ? null : grab(...place(event));
    point(...place(event));
  });

  canvas.addEventListener("pointermove", (event) => {
    const now = place(event);
    const before = fingers.get(event.pointerId);
    point(...now);
    if (!before) return;
    const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
    moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    if (moved < 4) return;
    if (held) held.move(...now);
    else if (other) pinch(view, before, now, other);
    else view.panBy(now[0] - before[0], now[1] - before[1]);
    fingers.set(event.pointerId, now);
    changed();
  });

  const lift = (event) => {
    const here = fingers.delete(event.pointerId);
    if (here && event.type === "pointerup" && moved < 4) held ? held.press() : click(...place(event));
    held = null;
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  // The readout of a tapped cell stays; a mouse that leaves the map hides it.
  canvas.addEventListener("pointerleave", (event) => event.pointerType !== "touch" && point(null, null));

  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1;
      view.zoomAt(...place(event), Math.exp(-event.deltaY * lines * (event.ctrlKey ? 0.01 : 0.0016)));
      changed();
    },
    { passive: false },
  );

  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const act = {
      ArrowLeft: () => view.panBy(KEY_PAN_PX, 0),
      ArrowRight: () => view.panBy(-KEY_PAN_PX, 0),
      ArrowUp: () => view.panBy(0, KEY_PAN_PX),
      ArrowDown: () => view.panBy(0, -KEY_PAN_PX),
      "+": () => view.zoomAt(view.width / 2, view.height / 2, 1.3),
      "=": () => view.zoomAt(view.width / 2, view.height / 2, 1.3),
      "-": () => view.zoomAt(view.width / 2, view.height / 2, 1 / 1.3),
      ...keys,
    }[event.shiftKey && event.key.startsWith("Arrow") ? `Shift+${event.key}` : event.key];
    if (!act) return;
    event.preventDefault();
    act();
    changed();
  });
}

function pinch(view, before, now, other) {
  const was = Math.hypot(before[0] - other[0], before[1] - other[1]);
  const is = Math.hypot(now[0] - other[0], now[1] - other[1]);
  view.panBy((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
  if (was > 0) view.zoomAt((now[0] + other[0]) / 2, (now[1] + other[1]) / 2, is / was);
}
