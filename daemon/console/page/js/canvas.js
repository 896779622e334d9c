// Text on canvases.

export const FONT = '11px ui-sans-serif, system-ui, -apple-system, "Segoe UI", "Liberation Sans", sans-serif';

/** Text with a halo in the sea's colour, so that it can be read on any label. */
export function haloText(c, string, x, y, ink) {
  c.lineWidth = 3;
  c.lineJoin = "round";
  c.strokeStyle = ink.sea;
  c.strokeText(string, x, y);
  c.fillStyle = ink.text;
  c.fillText(string, x, y);
}
