"""The map of an end at a time."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .geotiff import geotiff

# Width of the blocks of cells whose errors are taken as common in an interval: those of coarse cells.
BLOCK = 4

WKT = ('PROJCS["scenecast",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],'
       'PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],'
       'PARAMETER["False_Easting",0.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",{lon!r}],'
       'PARAMETER["Scale_Factor",1.0],PARAMETER["Latitude_Of_Origin",{lat!r}],UNIT["Meter",1.0]]')


def keys(x, y):
    """A number for each cell, in the order of columns and then of rows."""
    return (x.astype("i8") << 32) + y


def level_bounds(layer, place, cells):
    """The bounds of the levels of a layer at the keys of places, NaN where they are unknown."""
    found, edges = np.full((len(place), 2), np.nan), np.array(layer["edges"], float)
    if cells and len(cells[0]):
        held, levels = keys(cells[0], cells[1]), cells[2].astype(int) - layer["lowest"]
        order = np.argsort(held)
        at = order[np.minimum(np.searchsorted(held, place, sorter=order), len(held) - 1)]
        known = (held[at] == place) & (levels[at] >= 0) & (levels[at] < len(edges) - 1)
        level = levels[at][known]
        found[known] = np.stack((edges[level], edges[level + 1]), axis=1)
    return found


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
    # By name of the layer: the bounds of the level of each cell, two columns, NaN where it is unknown; and the unit.
    layers: dict = field(default_factory=dict)
    units: dict = field(default_factory=dict)

    def __len__(self):
        return len(self.label)

    def to_array(self, layer="label"):
        """The labels as bytes, row 0 southernmost, column 0 westernmost, 0 where nothing is explored.

        Of another layer the middles of the levels, NaN where they are unknown.
        """
        values = self.label
        if layer != "label":
            if layer not in self.layers:
                raise ValueError(f"the map has no layer {layer!r}: it has {', '.join(['label', *self.layers])}")
            values = self.layers[layer].mean(axis=1)
        if not len(self):
            return np.zeros((0, 0), values.dtype)
        shape = np.ptp(self.y) + 1, np.ptp(self.x) + 1
        array = np.zeros(shape, np.uint8) if layer == "label" else np.full(shape, np.nan)
        array[self.y - self.y.min(), self.x - self.x.min()] = values
        return array

    def axes(self):
        """The centres of the columns and rows, metres east and north; of the operator's map in the world frame."""
        if not len(self):
            return np.zeros(0), np.zeros(0)
        ranges = [np.arange(cells.min(), cells.max() + 1) for cells in (self.x, self.y)]
        return tuple((cells + 0.5) * self.cell_m + shift for cells, shift in zip(ranges, self.placement_m))

    def to_xarray(self, layer="label"):
        """A layer as an xarray.DataArray with the coordinates of `axes` in metres."""
        import xarray
        east, north = self.axes()
        attrs = {name: getattr(self, name) for name in ("cell_m", "epoch", "version", "time", "side")}
        attrs |= {"units": self.units[layer]} if self.units.get(layer) else {}
        coords = {name: (name, axis, {"units": "m"}) for name, axis in (("y", north), ("x", east))}
        return xarray.DataArray(self.to_array(layer), coords, ("y", "x"), layer, attrs)

    def to_tif(self, path):
        """Writes a GeoTIFF for QGIS, pixel value = label: in transverse Mercator about the origin, or in metres without one."""
        array, west, north = self._corner()
        Path(path).write_bytes(geotiff(array[::-1], west, north, self.cell_m, self.origin))

    def _corner(self):
        """The labels, and the western and northern edge of the map in metres."""
        if not len(self):
            raise ValueError("the map has no cells")
        east, north = self.axes()
        return self.to_array(), float(east[0]) - self.cell_m / 2, float(north[-1]) + self.cell_m / 2

    def to_asc(self, path):
        """Writes an ASCII grid for QGIS and GDAL in metres, and a .prj beside it if the mission has an origin."""
        path, (array, west, north) = Path(path), self._corner()
        south = north - array.shape[0] * self.cell_m
        head = f"ncols {array.shape[1]}\nnrows {array.shape[0]}\nxllcorner {west!r}\nyllcorner {south!r}\n"
        rows = "\n".join(" ".join(map(str, row)) for row in array[::-1])
        path.write_text(f"{head}cellsize {self.cell_m}\nNODATA_value 0\n{rows}\n", encoding="ascii")
        if self.origin:
            path.with_suffix(".prj").write_text(WKT.format(lat=self.origin[0], lon=self.origin[1]), encoding="ascii")

    def areas(self):
        """Of each label its name, the label that it is merged into, cells, m2, and the 95 % interval of the m2.

        The interval is NaN where the source has no confidence; the README says how it is calculated.
        """
        labels, group = np.unique(self.label, return_inverse=True)
        return [{"label": int(label), "name": self.names.get(int(label)), "merged_into": self.merged.get(int(label)), **area}
                for label, area in zip(labels, self._areas(group, len(labels)))]

    def areas_by_class(self):
        """The same of each class: the labels that the operator has merged or given one name."""
        labels, group = np.unique(self.label, return_inverse=True)
        classes = [self.class_of(label) for label in labels.tolist()]
        names = sorted(set(classes), key=classes.index)
        areas = self._areas(np.array([names.index(name) for name in classes], int)[group], len(names))
        return [{"class": name, "labels": [int(label) for label, of in zip(labels, classes) if of == name], **area}
                for name, area in zip(names, areas)]

    def class_of(self, label):
        """The name of a label, or of the one that it is merged into; without a name "label 7"."""
        for _ in range(254):
            if label not in self.merged:
                break
            label = self.merged[label]
        return self.names.get(label) or f"label {label}"

    def _areas(self, group, count):
        """The areas of the cells of each group."""
        cells, cell_m2 = np.bincount(group, minlength=count), self.cell_m ** 2
        bounds = self._interval(group, cells) * cell_m2
        return [{"cells": int(n), "area_m2": int(n) * cell_m2, "low_m2": float(low), "high_m2": float(high)}
                for n, (low, high) in zip(cells, bounds)]

    def _interval(self, group, cells):
        """The 95 % interval of the number of cells of each group, by the confidence of each cell."""
        confidence = self.layers.get("confidence")
        if confidence is None or np.isnan(confidence).all():
            return np.full((len(cells), 2), np.nan)
        ends = np.where(np.isnan(confidence), (0.0, 1.0), confidence)
        of_label = np.bincount(self.label, minlength=256)[self.label]
        others = np.maximum(len(self) - of_label, 1)
        _, block = np.unique(keys(self.x // BLOCK, self.y // BLOCK), return_inverse=True)
        found = []
        for number, size in enumerate(cells):
            # The doubt of a cell is shared among the other labels by their cells: a part of it stays in the group.
            own = group == number
            share = (np.where(own, size - of_label, size) / others)[:, None]
            chance = np.where(own[:, None], ends + (1 - ends) * share, (1 - ends) * share)
            least, most = chance.min(axis=1), chance.max(axis=1)
            middle = (least + most) / 2
            common = np.bincount(block, np.sqrt(middle * (1 - middle)))
            margin = 1.96 * np.sqrt(np.sum(common ** 2))
            found.append((max(least.sum() - margin, 0), min(most.sum() + margin, len(self))))
        return np.array(found)

    def compare(self, other):
        """The cells of this map that another map has too: by pair of classes, their number, area and agreement.

        Each cell is compared with the cell of the other map at its centre, in the world frame.
        """
        known = self._at_centres(other)
        both = known != 0
        pairs, cells = np.unique(self.label[both] * np.int64(256) + known[both], return_counts=True)
        table = {}
        for labels, count in zip(pairs.tolist(), cells.tolist()):
            pair = self.class_of(labels // 256), other.class_of(labels % 256)
            table[pair] = table.get(pair, 0) + count
        total = int(both.sum())
        equal = sum(count for (mine, theirs), count in table.items() if mine == theirs)
        return {"cells": total, "area_m2": total * self.cell_m ** 2, "agreement": equal / total if total else float("nan"),
                "pairs": table}

    def _at_centres(self, other):
        """The labels of another map at the centres of these cells, 0 where it has none."""
        labels = other.to_array()
        shift = np.array(self.placement_m, float) - other.placement_m + _between(other.origin, self.origin)
        at = [np.floor(((cells + 0.5) * self.cell_m + metres) / other.cell_m).astype(int) - (theirs.min() if len(theirs) else 0)
              for cells, theirs, metres in zip((self.x, self.y), (other.x, other.y), shift)]
        inside = np.logical_and.reduce([(a >= 0) & (a < size) for a, size in zip(at, labels.shape[::-1])])
        found = np.zeros(len(self), np.uint8)
        found[inside] = labels[at[1][inside], at[0][inside]]
        return found

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


def _between(start, end):
    """The metres east and north from one origin to another nearby; 0 if one is unknown."""
    if start is None or end is None:
        return np.zeros(2)
    lat, squared = np.radians((start[0] + end[0]) / 2), 0.00669437999014
    curve = 1 - squared * np.sin(lat) ** 2
    east, north = 6378137 / curve ** 0.5 * np.cos(lat), 6378137 * (1 - squared) / curve ** 1.5
    return np.radians([(end[1] - start[1] + 180) % 360 - 180, end[0] - start[0]]) * (east, north)


def described(state, vehicle, epoch, side):
    """What a state knows of a map of this epoch: names and mergers of labels, placement and origin."""
    shown = vehicle.get("map") or {}
    book = vehicle.get("label_book", {}) if shown.get("epoch") == epoch else {}
    names, merged = ({int(label): entry[key] for label, entry in book.items() if entry.get(key)} for key in ("name", "merged_into"))
    place = shown.get("placement") if side == "operator" else None
    origin = state.get("mission", {}).get("origin")
    return {"names": names, "merged": merged, "placement_m": (place["east_m"], place["north_m"]) if place else (0.0, 0.0),
            "origin": (origin["lat_deg"], origin["lon_deg"]) if origin else None}
