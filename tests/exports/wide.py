"""Compares the GeoTIFF exports of a wide survey with its CSV, cell by cell, with GDAL as the reader.

    python wide.py DIR LATITUDE LONGITUDE

DIR has map.csv, map.tif, map.utm.tif and map.wgs84.tif of `scenecast-bench wide --out DIR`; the place is that of its origin.
"""

import csv
import sys
from pathlib import Path

import numpy as np
import rasterio
import rasterio.warp

# Cells of which the whole file is read; the others are read one by one.
SAMPLES = 400


def main():
    directory, lat, lon = Path(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
    with (directory / "map.csv").open(newline="") as file:
        lines = [(float(r["east_m"]), float(r["north_m"]), int(r["label"])) for r in csv.DictReader(file)]
    label_at = {(round(x * 8), round(y * 8)): label for x, y, label in lines}
    assert max(x for x, _, _ in lines) - min(x for x, _, _ in lines) > 10000, "the survey is not wide"
    some = lines[:: max(1, len(lines) // SAMPLES)]
    # A cell between equal ones: a pixel half a cell off has the same label.
    uniform = [c for c in some if all(label_at.get((round((c[0] + i / 4) * 8), round((c[1] + j / 4) * 8))) == c[2] for i in (-1, 0, 1) for j in (-1, 0, 1))]
    mission = rasterio.crs.CRS.from_dict(proj="tmerc", lat_0=lat, lon_0=lon, k=1, datum="WGS84")
    zone = 32601 + int((lon + 180) // 6)
    for name, epsg, cells in [("map.tif", None, some), ("map.utm.tif", zone, uniform), ("map.wgs84.tif", 4326, uniform)]:
        assert len(cells) > 30, "too few cells for this check"
        with rasterio.open(directory / name) as image:
            assert image.is_tiled and image.colormap(1) and image.nodata == 0, name
            assert epsg is None or image.crs.to_epsg() == epsg, f"{name}: {image.crs}"
            x, y = rasterio.warp.transform(mission, image.crs, [c[0] for c in cells], [c[1] for c in cells])
            found = [int(v[0]) for v in image.sample(zip(x, y))]
            wrong = sum(f != c[2] for f, c in zip(found, cells))
            assert wrong == 0, f"{name}: {wrong} of {len(cells)} cells have another label"
            if name == "map.tif":
                full = sum(np.count_nonzero(image.read(1, window=w)) for _, w in image.block_windows(1) if w.row_off in (0, (image.height - 1) // 256 * 256))
                assert full > 0.4 * len(lines), f"{full} of {len(lines)} cells on the outer rows of tiles"
    print(f"{len(some)} cells of {len(lines)} have their labels in each file")


main()
