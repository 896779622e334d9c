"""The map of an end at a time."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

WKT = ('PROJCS["scenecast",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],'
       'PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
       'PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",{lon!r}],'
       'PARAMETER["Scale_Factor",1.0],PARAMETER["Latitude_Of_Origin",{lat!r}],UNIT["Meter",1.0]]')


@dataclass
class LabelMap:
    """The labelled cells of a map: columns, rows and labels; cell (0, 0) lies north-east of the map's origin."""

    x: np.ndarray
    y: np.ndarray
    label: np.ndarray
    cell_m: float
    epoch: int
    version: int
    time: float
    side: str
    names: dict = field(default_factory=dict)
    merged: dict = field(default_factory=dict)
    placement_m: tuple = (0.0, 0.0)
    origin: tuple | None = None

    def __len__(self):
        return len(self.label)

    def to_array(self):
        """The labels as bytes, row 0 southernmost, column 0 westernmost, 0 where nothing is explored."""
        if not len(self):
            return np.zeros((0, 0), np.uint8)
        array = np.zeros((np.ptp(self.y) + 1, np.ptp(self.x) + 1), np.uint8)
        array[self.y - self.y.min(), self.x - self.x.min()] = self.label
        return array

    def axes(self):
        """The centres of the columns and rows, metres east and north; of the operator's map in the world frame."""
        if not len(self):
            return np.zeros(0), np.zeros(0)
        ranges = [np.arange(cells.min(), cells.max() + 1) for cells in (self.x, self.y)]
        return tuple((cells + 0.5) * self.cell_m + shift for cells, shift in zip(ranges, self.placement_m))

    def to_xarray(self):
        """The labels as an xarray.DataArray with the coordinates of `axes` in metres."""
        import xarray
        east, north = self.axes()
        attrs = {name: getattr(self, name) for name in ("cell_m", "epoch", "version", "time", "side")}
        coords = {name: (name, axis, {"units": "m"}) for name, axis in (("y", north), ("x", east))}
        return xarray.DataArray(self.to_array(), coords, ("y", "x"), "label", attrs)

    def to_asc(self, path):
        """Writes an ASCII grid for QGIS and GDAL in metres, and a .prj beside it if the mission has an origin."""
        if not len(self):
            raise ValueError("the map has no cells")
        path, array, (east, north) = Path(path), self.to_array(), self.axes()
        west, south = (float(axis[0]) - self.cell_m / 2 for axis in (east, north))
        head = f"ncols {array.shape[1]}\nnrows {array.shape[0]}\nxllcorner {west!r}\nyllcorner {south!r}\n"
        rows = "\n".join(" ".join(map(str, row)) for row in array[::-1])
        path.write_text(f"{head}cellsize {self.cell_m}\nNODATA_value 0\n{rows}\n", encoding="ascii")
        if self.origin:
            path.with_suffix(".prj").write_text(WKT.format(lat=self.origin[0], lon=self.origin[1]), encoding="ascii")

    def areas(self):
        """Of each label its name, the label that it is merged into, cells and m2; no interval: see the README."""
        labels, cells = np.unique(self.label, return_counts=True)
        return [{"label": int(label), "name": self.names.get(int(label)), "merged_into": self.merged.get(int(label)),
                 "cells": int(count), "area_m2": int(count) * self.cell_m ** 2} for label, count in zip(labels, cells)]

    def fingerprint(self):
        """The fingerprint of the labels (protocol/WIRE.md, section 7), 16 bits."""
        with np.errstate(over="ignore"):
            low = self.y.astype(np.int64).astype(np.uint64) & np.uint64(0xFFFFFFFF)
            z = (self.x.astype(np.int64).astype(np.uint64) << np.uint64(32) | low) * np.uint64(0x9E3779B97F4A7C15)
            z ^= self.label.astype(np.uint64) * np.uint64(0xD6E8FEB86659FD93)
            for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
                z = (z ^ z >> np.uint64(shift)) * np.uint64(factor)
            folded = int(np.bitwise_xor.reduce(z ^ z >> np.uint64(31))) if len(z) else 0
        return (folded ^ folded >> 16 ^ folded >> 32 ^ folded >> 48) & 0xFFFF
