"""Reads the ZIP archive of a report: its tables, and the images that they name."""

import csv
import io
import sys
import zipfile

archive = zipfile.ZipFile(sys.argv[1])
assert archive.testzip() is None
files = set(archive.namelist())


def table(name):
    return list(csv.DictReader(io.TextIOWrapper(archive.open(name), "utf-8")))


assert {"report.html", "report.json", "events.csv", "auv_1/map.tif", "auv_1/map.geojson", "auv_1/orders.csv"} <= files, files
track = table("auv_1/track.csv")
assert len(track) > 20 and float(track[0]["sigma_m"]) >= 0, track
images = table("auv_1/images.csv")
assert images and all("auv_1/" + image["file"] in files for image in images), files
assert all(0.05 < float(image["width_m"]) < 5 and image["taken_utc"] <= image["received_utc"] for image in images), images
print(len(files))
