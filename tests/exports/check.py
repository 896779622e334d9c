"""Opens exported maps with common readers, and compares them cell by cell with the map of the API.

    python check.py DIR

DIR has state.json and map.json from the API, and map.png with map.pgw and map.png.aux.xml, map.geojson, map.ply, map.csv,
map.tif and, with an origin, map.utm.tif and map.wgs84.tif.
"""

import base64
import csv
import json
import math
import sys
from pathlib import Path

import numpy as np
import plyfile
import rasterio
import rasterio.warp
import shapely
import shapely.geometry

CENTIMETRE = 0.01


def tangent_plane(origin, lon, lat):
    """Metres east and north on the plane that touches WGS 84 at the origin: a computation independent of the checked one."""

    def ecef(lon, lat):
        lon, lat = math.radians(lon), math.radians(lat)
        e2 = (2 - 1 / 298.257223563) / 298.257223563
        n = 6378137 / math.sqrt(1 - e2 * math.sin(lat) ** 2)
        return np.array([n * math.cos(lat) * math.cos(lon), n * math.cos(lat) * math.sin(lon), n * (1 - e2) * math.sin(lat)])

    d = ecef(lon, lat) - ecef(origin["lon_deg"], origin["lat_deg"])
    lon, lat = math.radians(origin["lon_deg"]), math.radians(origin["lat_deg"])
    east = np.array([-math.sin(lon), math.cos(lon), 0])
    north = np.array([-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat)])
    return float(d @ east), float(d @ north)


class ApiMap:
    """The map of the API in the world frame."""

    def __init__(self, directory):
        state = json.loads((directory / "state.json").read_text())
        body = json.loads((directory / "map.json").read_text())
        self.origin = state["mission"]["origin"]
        self.cell = body["cell_m"]
        shape = (body["height"], body["width"])
        self.labels = np.frombuffer(base64.b64decode(body["labels"]), np.uint8).reshape(shape)
        moved = state["vehicles"][0]["map"]["placement"] or {"east_m": 0, "north_m": 0}
        self.west, self.south = body["x0"] * self.cell + moved["east_m"], body["y0"] * self.cell + moved["north_m"]
        rows, columns = np.nonzero(self.labels)
        self.x = self.west + (columns + 0.5) * self.cell
        self.y = self.south + (rows + 0.5) * self.cell
        self.label = self.labels[rows, columns]
        assert len(self.label) > 100, "the map has too few cells for this check"


def close(a, b, name, tolerance=CENTIMETRE):
    error = float(np.max(np.abs(np.asarray(a) - np.asarray(b))))
    assert error <= tolerance, f"{name}: error {error}, {tolerance} allowed"


def check_png(path, api):
    with rasterio.open(path) as image:
        a = image.transform
        assert (a.b, a.d) == (0, 0), "rotated"
        rows, columns = rasterio.transform.rowcol(a, api.x, api.y)
        assert (image.read(1)[np.array(rows), np.array(columns)] == api.label).all(), "labels"
        height = api.labels.shape[0]
        close(image.bounds, [api.west, api.south, api.west + api.labels.shape[1] * api.cell, api.south + height * api.cell], "bounds")
        if api.origin is None:
            assert image.crs is None or not (image.crs.is_geographic or image.crs.is_projected), "coordinates of an unknown place"
            return
        corners = [(0.0, 0.0), (3000.0, 2000.0), (-3000.0, 1000.0), *zip(api.x[:50], api.y[:50])]
        lon, lat = rasterio.warp.transform(image.crs, "EPSG:4326", *zip(*corners))
        close([tangent_plane(api.origin, *at) for at in zip(lon, lat)], corners, "projection")


def check_tiff(path, api):
    with rasterio.open(path) as image:
        assert image.is_tiled and image.block_shapes == [(256, 256)] and image.nodata == 0, "tiles"
        assert image.compression == rasterio.enums.Compression.deflate, "compression"
        colours = image.colormap(1)
        assert all(colours[label][:3] != (0, 0, 0) for label in set(api.label.tolist())), "palette"
        read, place = image.read(1), image.transform
        x, y = api.x, api.y
        if api.origin is None:
            assert image.crs is None, "coordinates of an unknown place"
        else:
            mission = rasterio.crs.CRS.from_dict(proj="tmerc", lat_0=api.origin["lat_deg"], lon_0=api.origin["lon_deg"], k=1, datum="WGS84")
            x, y = (np.array(v) for v in rasterio.warp.transform(mission, image.crs, api.x, api.y))
            corners = [(0.0, 0.0), (3000.0, 2000.0), (-3000.0, 1000.0)]
            there = rasterio.warp.transform(mission, image.crs, *zip(*corners))
            back = rasterio.warp.transform(image.crs, "EPSG:4326", *there)
            close([tangent_plane(api.origin, *at) for at in zip(*back)], corners, "projection")
        rows, columns = (np.array(v) for v in rasterio.transform.rowcol(place, x, y))
        found = read[rows, columns]
        if path.name == "map.tif":
            assert (found == api.label).all() and np.count_nonzero(read) == len(api.label), "labels"
            return
        zone = 32601 + int((api.origin["lon_deg"] + 180) // 6) + (100 if api.origin["lat_deg"] < 0 else 0)
        assert image.crs.to_epsg() == (zone if path.name == "map.utm.tif" else 4326), str(image.crs)
        # The pixel at the centre of a cell belongs to this cell or to a neighbour, so inside a region the labels agree.
        padded = np.pad(api.labels, 1)
        around = np.stack([padded[1 + i : 1 + i + api.labels.shape[0], 1 + j : 1 + j + api.labels.shape[1]] for i in (-1, 0, 1) for j in (-1, 0, 1)])
        inside = (around == api.labels).all(axis=0)[np.nonzero(api.labels)]
        assert inside.sum() > 100 and (found[inside] == api.label[inside]).all(), "labels inside regions"
        assert (found == api.label).mean() > 0.8, "labels"
        # A pixel has about the area of a cell.
        side = 1 if path.name == "map.utm.tif" else 111320 * math.sqrt(math.cos(math.radians(api.origin["lat_deg"])))
        assert abs(math.sqrt(abs(place.a * place.e)) * side / api.cell - 1) < 0.01, "pixels"


def check_geojson(path, api):
    document = json.loads(path.read_text())
    regions = {f["properties"]["label"]: shapely.geometry.shape(f["geometry"]) for f in document["features"]}
    assert set(regions) == set(api.label.tolist()), "labels"
    if api.origin is None:
        place = list(zip(api.x, api.y))
    else:
        crs = rasterio.crs.CRS.from_dict(proj="tmerc", lat_0=api.origin["lat_deg"], lon_0=api.origin["lon_deg"], k=1, datum="WGS84")
        place = list(zip(*rasterio.warp.transform(crs, "EPSG:4326", api.x, api.y)))
        first = next(iter(regions.values())).geoms[0].exterior.coords[0]
        x, y = tangent_plane(api.origin, *first)
        corner = [(x - api.west) / api.cell, (y - api.south) / api.cell]
        close(corner, np.round(corner), "corners of cells", CENTIMETRE / api.cell)
    for label, region in regions.items():
        assert region.is_valid, f"label {label}: {shapely.is_valid_reason(region)}"
        inside = shapely.contains_xy(region, *zip(*place))
        assert (inside == (api.label == label)).all(), f"label {label}: its region has other cells"


def check_ply(path, api):
    vertices = plyfile.PlyData.read(str(path))["vertex"]
    order, wanted = np.lexsort((vertices["x"], vertices["y"])), np.lexsort((api.x, api.y))
    close(vertices["x"][order], api.x[wanted], "x")
    close(vertices["y"][order], api.y[wanted], "y")
    assert (vertices["label"][order] == api.label[wanted]).all(), "labels"
    assert np.isfinite(vertices["z"]).all() and {"red", "green", "blue"} <= {p.name for p in vertices.properties}


def check_csv(path, api):
    with path.open(newline="") as file:
        lines = list(csv.DictReader(file))
    close([float(line["east_m"]) for line in lines], api.x, "east")
    close([float(line["north_m"]) for line in lines], api.y, "north")
    assert [int(line["label"]) for line in lines] == api.label.tolist(), "labels"


def main():
    directory = Path(sys.argv[1])
    api = ApiMap(directory)
    checks = {"png": check_png, "geojson": check_geojson, "ply": check_ply, "csv": check_csv, "tif": check_tiff}
    if api.origin is not None:
        checks.update({"utm.tif": check_tiff, "wgs84.tif": check_tiff})
    for extension, check in checks.items():
        path = directory / f"map.{extension}"
        try:
            check(path, api)
        except AssertionError as e:
            sys.exit(f"{path}: {e}")
    print(f"{len(api.label)} cells are in the right place in each file")


main()
