"""Opens exported maps with the readers that others use, and compares them cell by cell with the map that the API told.

    python check.py DIR

DIR has state.json and map.json as the API told them, and of each MAKER (ctl, page) MAKER.png with MAKER.pgw and
MAKER.png.aux.xml, MAKER.geojson, MAKER.ply, MAKER.csv.
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
    """Metres east and north on the plane that touches WGS 84 at the origin: another way than the one that is checked."""

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


class Told:
    """The map as the API told it, where it lies in the world."""

    def __init__(self, directory):
        state = json.loads((directory / "state.json").read_text())
        told = json.loads((directory / "map.json").read_text())
        self.origin = state["mission"]["origin"]
        self.cell = told["cell_m"]
        shape = (told["height"], told["width"])
        self.labels = np.frombuffer(base64.b64decode(told["labels"]), np.uint8).reshape(shape)
        moved = state["vehicles"][0]["map"]["placement"] or {"east_m": 0, "north_m": 0}
        self.west, self.south = told["x0"] * self.cell + moved["east_m"], told["y0"] * self.cell + moved["north_m"]
        rows, columns = np.nonzero(self.labels)
        self.x = self.west + (columns + 0.5) * self.cell
        self.y = self.south + (rows + 0.5) * self.cell
        self.label = self.labels[rows, columns]
        assert len(self.label) > 100, "the map has too few cells to tell right from wrong"


def close(a, b, what, most=CENTIMETRE):
    worst = float(np.max(np.abs(np.asarray(a) - np.asarray(b))))
    assert worst <= most, f"{what}: {worst} off, {most} allowed"


def check_png(path, told):
    with rasterio.open(path) as image:
        a = image.transform
        assert (a.b, a.d) == (0, 0), "rotated"
        rows, columns = rasterio.transform.rowcol(a, told.x, told.y)
        assert (image.read(1)[np.array(rows), np.array(columns)] == told.label).all(), "labels"
        height = told.labels.shape[0]
        close(image.bounds, [told.west, told.south, told.west + told.labels.shape[1] * told.cell, told.south + height * told.cell], "bounds")
        if told.origin is None:
            assert image.crs is None or not (image.crs.is_geographic or image.crs.is_projected), "a place on the Earth that nobody knows"
            return
        corners = [(0.0, 0.0), (3000.0, 2000.0), (-3000.0, 1000.0), *zip(told.x[:50], told.y[:50])]
        lon, lat = rasterio.warp.transform(image.crs, "EPSG:4326", *zip(*corners))
        close([tangent_plane(told.origin, *at) for at in zip(lon, lat)], corners, "projection")


def check_geojson(path, told):
    document = json.loads(path.read_text())
    regions = {f["properties"]["label"]: shapely.geometry.shape(f["geometry"]) for f in document["features"]}
    assert set(regions) == set(told.label.tolist()), "labels"
    if told.origin is None:
        place = list(zip(told.x, told.y))
    else:
        crs = rasterio.crs.CRS.from_dict(proj="tmerc", lat_0=told.origin["lat_deg"], lon_0=told.origin["lon_deg"], k=1, datum="WGS84")
        place = list(zip(*rasterio.warp.transform(crs, "EPSG:4326", told.x, told.y)))
        first = next(iter(regions.values())).geoms[0].exterior.coords[0]
        x, y = tangent_plane(told.origin, *first)
        corner = [(x - told.west) / told.cell, (y - told.south) / told.cell]
        close(corner, np.round(corner), "corners of cells", CENTIMETRE / told.cell)
    for label, region in regions.items():
        assert region.is_valid, f"label {label}: {shapely.is_valid_reason(region)}"
        inside = shapely.contains_xy(region, *zip(*place))
        assert (inside == (told.label == label)).all(), f"label {label}: its region has other cells"


def check_ply(path, told):
    vertices = plyfile.PlyData.read(str(path))["vertex"]
    order, wanted = np.lexsort((vertices["x"], vertices["y"])), np.lexsort((told.x, told.y))
    close(vertices["x"][order], told.x[wanted], "x")
    close(vertices["y"][order], told.y[wanted], "y")
    assert (vertices["label"][order] == told.label[wanted]).all(), "labels"
    assert np.isfinite(vertices["z"]).all() and {"red", "green", "blue"} <= {p.name for p in vertices.properties}


def check_csv(path, told):
    with path.open(newline="") as file:
        lines = list(csv.DictReader(file))
    close([float(line["east_m"]) for line in lines], told.x, "east")
    close([float(line["north_m"]) for line in lines], told.y, "north")
    assert [int(line["label"]) for line in lines] == told.label.tolist(), "labels"


def main():
    directory = Path(sys.argv[1])
    told = Told(directory)
    for maker in ("ctl", "page"):
        for extension, check in {"png": check_png, "geojson": check_geojson, "ply": check_ply, "csv": check_csv}.items():
            path = directory / f"{maker}.{extension}"
            try:
                check(path, told)
            except AssertionError as e:
                sys.exit(f"{path}: {e}")
    print(f"{len(told.label)} cells are where they belong in the files of both makers")


main()
