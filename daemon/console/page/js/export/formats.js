// The map as files: CSV of cells, GeoJSON of regions, PLY of points, PNG with a world file. Places are those of the world, to
// which fixes have moved the vehicle's map.

import { colourOf, nameOf, shownAs } from "../book.js";
import { depthPlane } from "../cloud/points.js";
import { inWorld } from "../map/frames.js";
import { toLatLon } from "../map/readout.js";
import { rgb } from "../palette.js";
import { regions } from "./regions.js";

const quoted = (s) => `"${s.replaceAll('"', '""')}"`;

function* cells(map, vehicle) {
  for (let at = 0; at < map.labels.length; at += 1) {
    if (map.labels[at] === 0) continue;
    const [column, row] = [at % map.width, Math.floor(at / map.width)];
    const [x, y] = inWorld(vehicle, (map.x0 + column + 0.5) * map.cell_m, (map.y0 + row + 0.5) * map.cell_m);
    yield { at, x, y, label: map.labels[at] };
  }
}

const valueOf = (plane, at) =>
  plane.data[at] === 255 ? "" : (plane.min + ((plane.max - plane.min) * plane.data[at]) / 254).toFixed(3);

/** One line a cell: centre in metres, label as the vehicle knows it, as shown, age, planes. */
export function toCsv(map, vehicle, sinceFetchS) {
  const lines = [["east_m", "north_m", "label", "shown_as", "name", "age_s", ...map.planes.map((p) => p.name)].join(",")];
  for (const { at, x, y, label } of cells(map, vehicle)) {
    const shown = shownAs(label);
    const age = map.age[at] === 65535 ? "" : Math.round(map.age[at] + sinceFetchS);
    lines.push([x.toFixed(3), y.toFixed(3), label, shown, quoted(nameOf(shown)), age, ...map.planes.map((p) => valueOf(p, at))].join(","));
  }
  return `${lines.join("\n")}\n`;
}

/** Regions of equal label. WGS 84 when the mission has an origin, else metres east and north of it. */
export function toGeoJson(map, vehicle, origin, nowS) {
  const shown = map.labels.map((label) => (label === 0 ? 0 : shownAs(label)));
  const place = ([cx, cy]) => {
    const [x, y] = inWorld(vehicle, (map.x0 + cx) * map.cell_m, (map.y0 + cy) * map.cell_m);
    return origin ? toLatLon(origin, x, y).reverse().map((v) => Number(v.toFixed(9))) : [x, y];
  };
  const features = [...regions(shown, map.width, map.height)].sort((a, b) => a[0] - b[0]).map(([label, polygons]) => ({
    type: "Feature",
    id: label,
    properties: {
      label, name: nameOf(label), colour: colourOf(label), vehicle: vehicle.name,
      area_m2: shown.reduce((n, v) => n + (v === label ? 1 : 0), 0) * map.cell_m ** 2,
    },
    geometry: { type: "MultiPolygon", coordinates: polygons.map((rings) => rings.map((ring) => ring.map(place))) },
  }));
  const about = { map_version: map.version, epoch: map.epoch, mission_time_s: Math.round(nowS) };
  if (!origin) about.coordinates = "metres east and north of the mission's origin";
  return JSON.stringify({ type: "FeatureCollection", scenecast: about, features });
}

/** ASCII PLY: x east, y north, z up (0 where no depth is known), colour, label. */
export function toPly(map, vehicle) {
  const depth = depthPlane(map);
  const lines = [];
  for (const { at, x, y, label } of cells(map, vehicle)) {
    const z = depth && depth.data[at] !== 255 ? (-Number(valueOf(depth, at))).toFixed(3) : "0";
    lines.push(`${x.toFixed(3)} ${y.toFixed(3)} ${z} ${rgb(colourOf(shownAs(label))).join(" ")} ${label}`);
  }
  const head = ["ply", "format ascii 1.0", "comment scenecast map, metres east, north, up", `element vertex ${lines.length}`,
    "property double x", "property double y", "property double z",
    "property uchar red", "property uchar green", "property uchar blue", "property uchar label", "end_header"];
  return `${[...head, ...lines].join("\n")}\n`;
}

/** The six lines of a world file: pixel size and the centre of the north-west pixel. */
export function toWorldFile(map, vehicle) {
  const [west, north] = inWorld(vehicle, (map.x0 + 0.5) * map.cell_m, (map.y0 + map.height - 0.5) * map.cell_m);
  return [map.cell_m, 0, 0, -map.cell_m, west, north].map((v) => `${v}\n`).join("");
}

/** The `.aux.xml` file beside a PNG, where GDAL and QGIS look for the projection; null without an origin. */
export function toProjection(origin) {
  if (!origin) return null;
  const { lat_deg, lon_deg } = origin;
  const text = `PROJCS["metres east and north of ${lat_deg} ${lon_deg}",GEOGCS["WGS 84",DATUM["WGS_1984",` +
    'SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],' +
    `PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",${lat_deg}],PARAMETER["central_meridian",${lon_deg}],` +
    'PARAMETER["scale_factor",1],PARAMETER["false_easting",0],PARAMETER["false_northing",0],UNIT["metre",1],' +
    'AXIS["Easting",EAST],AXIS["Northing",NORTH]]';
  return `<PAMDataset>\n  <SRS dataAxisToSRSAxisMapping="1,2">${text.replaceAll('"', "&quot;")}</SRS>\n</PAMDataset>\n`;
}
