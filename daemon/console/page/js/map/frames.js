// Two frames, both x east and y north in metres: the chart and all that people draw on it are of the world; what a vehicle
// tells (cells, track, waypoint, path, itself) is of its own map, which lies in the world where the placement says.

/** Where the map of a vehicle lies: east and north, metres. */
export function placed(vehicle) {
  const by = vehicle?.map?.placement;
  return by ? [by.east_m, by.north_m] : [0, 0];
}

/** A place of a vehicle's map in the world: east and north of the mission's origin. */
export function inWorld(vehicle, x, y) {
  const [east, north] = placed(vehicle);
  return [x + east, y + north];
}

/** A place of the world on a vehicle's map. */
export function onMap(vehicle, x, y) {
  const [east, north] = placed(vehicle);
  return [x - east, y - north];
}

/** A box [west, south, east, north] of a vehicle's map in the world. */
export function boxInWorld(vehicle, [west, south, east, north]) {
  return [...inWorld(vehicle, west, south), ...inWorld(vehicle, east, north)];
}

/** The view as a vehicle's things are drawn in it. */
export function viewOf(view, vehicle) {
  return Object.create(view, { toScreen: { value: (x, y) => view.toScreen(...inWorld(vehicle, x, y)) } });
}
