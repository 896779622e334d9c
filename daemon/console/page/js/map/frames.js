// Two frames, both with x east and y north in metres. The chart and drawings of people are in the world frame. Cells, track,
// waypoint, path and position of a vehicle are in the frame of its map, which the placement moves into the world.

/** The placement of a vehicle's map: metres east and north. */
function placementOf(vehicle) {
  const by = vehicle?.map?.placement;
  return by ? [by.east_m, by.north_m] : [0, 0];
}

/** From a vehicle's map to the world: metres east and north of the mission's origin. */
export function inWorld(vehicle, x, y) {
  const [east, north] = placementOf(vehicle);
  return [x + east, y + north];
}

/** From the world to a vehicle's map. */
export function onMap(vehicle, x, y) {
  const [east, north] = placementOf(vehicle);
  return [x - east, y - north];
}

/** A box [west, south, east, north] from a vehicle's map to the world. */
export function boxInWorld(vehicle, [west, south, east, north]) {
  return [...inWorld(vehicle, west, south), ...inWorld(vehicle, east, north)];
}

/** A view that takes places in the frame of a vehicle's map. */
export function viewOf(view, vehicle) {
  return Object.create(view, { toScreen: { value: (x, y) => view.toScreen(...inWorld(vehicle, x, y)) } });
}
