"""Opens exported maps with common readers, and compares them cell by cell with the map of the API.

    python check.py DIR

DIR has state.json and map.json from the API, and map.png with map.pgw and map.png.aux.xml, map.geojson, map.ply, map.csv,
map.labels.csv, map.coco.json, map.taglab.json, map.tif and, with an origin, map.utm.tif and map.wgs84.tif, each with its .aux.xml.
"""

import base64
import csv
import json
import math
import struct
import sys
import xml.etree.ElementTree
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
        vehicle = state["vehicles"][0]
        self.vehicle, self.book = vehicle["name"], {int(label): entry for label, entry in vehicle["label_book"].items()}
        assert any(entry["merged_into"] for entry in self.book.values()), "no label is merged"

    def of(self, label, what):
        return self.book.get(label, {}).get(what)

    def shown_as(self, label):
        into = self.of(label, "merged_into")
        return self.shown_as(into) if into else label

    def class_name(self, label):
        shown = self.shown_as(label)
        return self.of(shown, "name") or f"label {shown}"

    def colour(self, label):
        """The operator's colour of the class, if there is one."""
        text = self.of(self.shown_as(label), "colour")
        return text and tuple(bytes.fromhex(text[1:]))


def close(a, b, name, tolerance=CENTIMETRE):
    error = float(np.max(np.abs(np.asarray(a) - np.asarray(b))))
    assert error <= tolerance, f"{name}: error {error}, {tolerance} allowed"


def check_colours(image, api):
    colours = image.colormap(1)
    for label in set(api.label.tolist()):
        assert colours[label] == colours[api.shown_as(label)] and colours[label][:3] != (0, 0, 0), f"colour of label {label}"
        assert api.colour(label) in (None, colours[label][:3]), f"the operator's colour of label {label}"


def check_companion(path, api):
    """The names of the classes, where GDAL looks for them."""
    root = xml.etree.ElementTree.parse(f"{path}.aux.xml").getroot()
    names = [category.text for category in root.findall("PAMRasterBand/CategoryNames/Category")]
    for label in set(api.label.tolist()):
        assert names[label] == api.class_name(label), f"{names[label]} instead of {api.class_name(label)}"
    facts = {item.get("key"): item.text for item in root.findall("Metadata/MDI")}
    assert facts["vehicle_name"] == api.vehicle and facts["utc"].endswith("Z"), facts


def check_png(path, api):
    check_companion(path, api)
    with rasterio.open(path) as image:
        check_colours(image, api)
        assert image.nodata == 0, "unexplored cells are data"
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
    check_companion(path, api)
    start, = struct.unpack("<I", path.read_bytes()[4:8])
    assert start < 300, "the directory is not at the beginning, as readers by network want it"
    with rasterio.open(path) as image:
        check_colours(image, api)
        tags = image.tags()
        assert tags["vehicle_name"] == api.vehicle, tags
        assert all(tags[f"label_{label}"] == api.class_name(label) for label in set(api.label.tolist())), tags
        assert image.is_tiled and image.block_shapes == [(256, 256)] and image.nodata == 0, "tiles"
        assert image.compression == rasterio.enums.Compression.deflate, "compression"
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
    check_fields([f["properties"] for f in document["features"]], api)
    if api.origin is None:
        assert document["crs"]["properties"]["name"].startswith("LOCAL_CS["), "metres that are taken for degrees"
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
    check_fields(lines, api)
    assert not any(line["name"].startswith("=") for line in lines), "a formula"


def check_fields(lines, api):
    """Name, class and colour of each label as fields of a table. A name that begins as a formula has an apostrophe before."""
    for line in lines:
        label = int(line["label"])
        assert int(line["class"]) == api.shown_as(label), line
        assert (line["class_name"] or "").lstrip("'") == api.class_name(label), line
        assert (line["name"] or "").lstrip("'") == (api.of(label, "name") or ""), line
        assert api.colour(label) in (None, tuple(bytes.fromhex(line["colour"][1:]))), line


def check_labels(path, api):
    with path.open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert {int(line["label"]): int(line["cells"]) for line in lines} == dict(zip(*np.unique(api.label, return_counts=True))), "cells"
    check_fields(lines, api)
    assert all(line["vehicle_name"] == api.vehicle for line in lines), "vehicle"


def check_coco(path, api):
    document = json.loads(path.read_text())
    names = {category["id"]: category["name"] for category in document["categories"]}
    height, width = api.labels.shape
    found = np.zeros((height, width), np.uint8)
    for annotation in document["annotations"]:
        counts = annotation["segmentation"]["counts"]
        assert annotation["segmentation"]["size"] == [height, width] and sum(counts) == height * width, "runs"
        mask = np.repeat(np.arange(len(counts)) % 2 == 1, counts).reshape(width, height).T
        rows, columns = np.nonzero(mask)
        box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
        assert annotation["bbox"] == box and annotation["area"] == mask.sum(), "box"
        assert names[annotation["category_id"]] == api.class_name(annotation["category_id"]), "names"
        found[mask] = annotation["category_id"]
    shown = np.array([api.shown_as(label) if label else 0 for label in range(256)], np.uint8)
    assert (found == shown[api.labels[::-1]]).all(), "classes"


def check_tag_lab(path, api):
    labels = {label["name"]: tuple(label["fill"]) for label in json.loads(path.read_text())["Labels"]}
    with rasterio.open(path.parent / "map.png") as image:
        colours = image.colormap(1)
    for label in set(api.label.tolist()):
        assert labels[api.class_name(label)] == colours[label][:3], f"label {label}"


def main():
    directory = Path(sys.argv[1])
    api = ApiMap(directory)
    checks = {"png": check_png, "geojson": check_geojson, "ply": check_ply, "csv": check_csv, "tif": check_tiff}
    checks.update({"labels.csv": check_labels, "coco.json": check_coco, "taglab.json": check_tag_lab})
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
