// Label regions as polygons: the outlines of 4-connected patches of equal cells, with their holes.

const STEPS = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/** Patch number of each cell (-1: none) and the value of each patch. */
function patches(values, width, height) {
  const patch = new Int32Array(values.length).fill(-1);
  const value = [];
  const stack = [];
  for (let start = 0; start < values.length; start += 1) {
    if (values[start] === 0 || patch[start] !== -1) continue;
    const id = value.push(values[start]) - 1;
    stack.push(start);
    patch[start] = id;
    while (stack.length > 0) {
      const at = stack.pop();
      const [x, y] = [at % width, Math.floor(at / width)];
      for (const [dx, dy] of STEPS) {
        const [nx, ny] = [x + dx, y + dy];
        const to = ny * width + nx;
        if (nx < 0 || ny < 0 || nx >= width || ny >= height || patch[to] !== -1 || values[to] !== values[start]) continue;
        patch[to] = id;
        stack.push(to);
      }
    }
  }
  return { patch, value };
}

/** Border edges keyed by start corner, each with its patch on the left: corner -> [{step, patch}]. */
function borders(patch, width, height) {
  const edges = new Map();
  const other = (x, y, id) => x < 0 || y < 0 || x >= width || y >= height || patch[y * width + x] !== id;
  const add = (x, y, step, id) => {
    const corner = y * (width + 1) + x;
    if (!edges.has(corner)) edges.set(corner, []);
    edges.get(corner).push({ step, id });
  };
  for (let y = 0; y < height; y += 1)
    for (let x = 0; x < width; x += 1) {
      const id = patch[y * width + x];
      if (id === -1) continue;
      if (other(x, y - 1, id)) add(x, y, 0, id);
      if (other(x + 1, y, id)) add(x + 1, y, 1, id);
      if (other(x, y + 1, id)) add(x + 1, y + 1, 2, id);
      if (other(x - 1, y, id)) add(x, y + 1, 3, id);
    }
  return edges;
}

/** Follows one ring from a corner; where two edges of the patch leave, the right turn keeps the ring from touching itself. */
function follow(edges, corner, width) {
  const first = edges.get(corner).pop();
  const ring = [];
  let [at, edge] = [corner, first];
  let before = -1;
  for (;;) {
    const [x, y] = [at % (width + 1), Math.floor(at / (width + 1))];
    if (edge.step !== before) ring.push([x, y]);
    before = edge.step;
    at = (y + STEPS[edge.step][1]) * (width + 1) + x + STEPS[edge.step][0];
    if (at === corner && !(edges.get(at) ?? []).some((e) => e.id === first.id && e.step === (edge.step + 3) % 4)) break;
    const leaving = edges.get(at);
    const wanted = [3, 0, 1].map((turn) => leaving.findIndex((e) => e.id === first.id && e.step === (before + turn) % 4));
    const next = wanted.find((i) => i !== -1);
    edge = leaving.splice(next, 1)[0];
  }
  if (before === first.step) ring.shift();
  return { id: first.id, ring: [...ring, ring[0]] };
}

const area2 = (ring) =>
  ring.slice(1).reduce((sum, [x, y], i) => sum + ring[i][0] * y - x * ring[i][1], 0);

/** Map value -> list of polygons, each [outer ring, ...holes] in cell corners, outer rings anticlockwise. */
export function regions(values, width, height) {
  const { patch, value } = patches(values, width, height);
  const edges = borders(patch, width, height);
  const polygons = value.map(() => []);
  for (const [corner, leaving] of edges) {
    while (leaving.length > 0) {
      const { id, ring } = follow(edges, corner, width);
      if (area2(ring) > 0) polygons[id].unshift(ring);
      else polygons[id].push(ring);
    }
  }
  const byValue = new Map();
  polygons.forEach((rings, id) => {
    if (!byValue.has(value[id])) byValue.set(value[id], []);
    byValue.get(value[id]).push(rings);
  });
  return byValue;
}
