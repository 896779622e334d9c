"""Tests on maps that are made here."""

import numpy as np
import pytest

from scenecast import LabelMap


def label_map(rows, confidence=None, names=None, merged=None, cell_m=0.5, x0=0, y0=0, **more):
    """A map of rows from the south, 0 where nothing is explored; `confidence` is the bounds of every cell, or their list."""
    y, x = np.nonzero(np.array(rows))
    layers = {}
    if confidence is not None:
        layers["confidence"] = np.broadcast_to(np.array(confidence, float), (len(x), 2))
    return LabelMap(x + x0, y + y0, np.array(rows, "u1")[y, x], cell_m, 0, 1, 0.0, "operator", names or {}, merged or {},
                    layers=layers, **more)


def by(key, areas):
    return {area[key]: area for area in areas}


def test_areas_have_names_and_square_metres():
    found = label_map([[3, 3]], names={3: "sand"}, merged={3: 1}).areas()
    assert [{key: area[key] for key in ("label", "name", "merged_into", "cells", "area_m2")} for area in found] == [
        {"label": 3, "name": "sand", "merged_into": 1, "cells": 2, "area_m2": 0.5}]


def test_areas_without_confidence_have_no_interval():
    for confidence in (None, (np.nan, np.nan)):
        area, = label_map([[3, 3]], confidence).areas()
        assert np.isnan(area["low_m2"]) and np.isnan(area["high_m2"])


def test_full_confidence_leaves_no_doubt_and_none_leaves_the_whole_map():
    rows = [[1] * 30 + [2] * 10] * 10
    for area in label_map(rows, (1.0, 1.0)).areas():
        assert area["low_m2"] == area["area_m2"] == area["high_m2"]
    for area in label_map(rows, [(np.nan, np.nan)] * 399 + [(1.0, 1.0)]).areas():
        assert area["low_m2"] < 0.02 * 100 and area["high_m2"] > area["area_m2"]


def test_the_interval_is_that_of_the_formula():
    # Four cells of one block: three of label 1, one of label 2, each right by 0.8.
    areas = by("label", label_map([[1, 1, 1, 2]], (0.8, 0.8), cell_m=1.0).areas())
    # Cells of 1: 0.8 each, and all of the doubt of the cell of 2; all err together.
    middle, margin = 3 * 0.8 + 0.2, 1.96 * (3 * 0.4 + 0.4)
    assert areas[1]["low_m2"] == pytest.approx(max(middle - margin, 0))
    assert areas[1]["high_m2"] == pytest.approx(min(middle + margin, 4))
    # In blocks of their own, they err one by one.
    far = label_map([[1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2]], (0.8, 0.8), cell_m=1.0)
    assert by("label", far.areas())[1]["low_m2"] == pytest.approx(middle - 1.96 * (4 * 0.16) ** 0.5)


def test_intervals_hold_for_worlds_that_are_as_doubtful_as_the_confidence_says():
    chance, held, missed = np.random.default_rng(1), 0, 0
    for _ in range(60):
        # Blocks of 4 x 4 cells with one label each; a block is wrong by 1 - confidence, and is then of another label.
        blocks = chance.choice([1, 2, 3], (12, 12), p=[0.6, 0.3, 0.1])
        others = np.array([np.sum(blocks == label) for label in (1, 2, 3)], float)
        true = blocks.copy()
        for at in zip(*np.nonzero(chance.random(blocks.shape) > 0.8)):
            share = np.where(np.arange(1, 4) == blocks[at], 0, others)
            true[at] = chance.choice([1, 2, 3], p=share / share.sum())
        rows = blocks.repeat(4, 0).repeat(4, 1)
        for area in label_map(rows, (0.8, 0.8), cell_m=1.0).areas():
            inside = area["low_m2"] <= 16 * np.sum(true == area["label"]) <= area["high_m2"]
            held, missed = held + inside, missed + (not inside)
    assert 0.90 <= held / (held + missed) <= 0.99


def test_classes_join_labels_that_are_merged_or_have_one_name():
    names, merged = {1: "sand", 3: "sand", 4: "reef"}, {2: 5, 5: 4}
    found = label_map([[1, 1, 2, 3, 4, 6]], (0.5, 0.75), names, merged)
    assert {area["class"]: (area["labels"], area["cells"]) for area in found.areas_by_class()} == {
        "sand": ([1, 3], 3), "reef": ([2, 4], 2), "label 6": ([6], 1)}
    # Doubt between two labels of a class is none about the class.
    whole = label_map([[1] * 20 + [3] * 20], (0.5, 0.5), names).areas_by_class()
    assert [(area["low_m2"], area["high_m2"]) for area in whole] == [(10.0, 10.0)]


def test_labels_that_are_merged_in_a_circle_do_not_hang():
    assert label_map([[1]], merged={1: 2, 2: 1}).class_of(1).startswith("label ")


def test_layers_are_arrays_of_the_middles_of_their_levels():
    found = label_map([[1, 0], [0, 2]], [(0.25, 0.5), (np.nan, np.nan)])
    assert np.isnan(found.to_array("confidence")).tolist() == [[False, True], [True, True]]
    assert found.to_array("confidence")[0, 0] == 0.375
    with pytest.raises(ValueError, match="no layer 'depth'"):
        found.to_array("depth")


def test_maps_compare_cell_by_cell_in_the_world():
    one = label_map([[1, 1, 2], [1, 2, 2]], names={1: "sand", 2: "reef"})
    assert one.compare(one) == {"cells": 6, "area_m2": 1.5, "agreement": 1.0, "pairs": {("sand", "sand"): 3, ("reef", "reef"): 3}}
    # The same place with other numbers, another origin of the map and one column more.
    other = label_map([[4, 4, 7, 7], [4, 4, 7, 7]], names={4: "sand", 7: "reef"}, x0=100, y0=-10, placement_m=(-50.0, 5.0))
    found = one.compare(other)
    assert found["pairs"] == {("sand", "sand"): 3, ("reef", "reef"): 2, ("reef", "sand"): 1}
    assert (found["cells"], found["agreement"]) == (6, 5 / 6)
    away = one.compare(label_map([[1]], x0=50))
    assert away["cells"] == 0 and np.isnan(away["agreement"])
    assert one.compare(label_map([[0]]))["cells"] == 0


def test_maps_compare_across_origins_and_sizes_of_cells():
    names = {1: "sand", 2: "reef"}
    one = label_map([[1, 2], [1, 2]], names=names, cell_m=10.0, origin=(60.0, 10.0))
    # An origin 22.5 m east and 12.5 m north, by the lengths of a degree at 60 degrees north (111412 m and 55800 m).
    two = label_map([[1] * 2 + [2] * 2] * 8, names=names, cell_m=5.0, x0=-4, y0=-2,
                    origin=(60.0 + 12.5 / 111412, 10.0 + 22.5 / 55800))
    assert one.compare(two)["pairs"] == {("sand", "sand"): 2, ("reef", "reef"): 2}


@pytest.mark.parametrize("origin", [None, (43.5, 7.25)])
def test_a_geotiff_has_labels_place_and_projection(tmp_path, origin):
    rasterio = pytest.importorskip("rasterio")
    found = label_map([[1, 2, 0], [3, 0, 254]], x0=10, y0=-4, origin=origin)
    found.to_tif(tmp_path / "map.tif")
    with rasterio.open(tmp_path / "map.tif") as read:
        assert (read.read(1)[::-1] == found.to_array()).all() and read.nodata == 0
        assert tuple(read.transform)[:6] == (0.5, 0, 5.0, 0, -0.5, -1.0)
        crs = read.crs and read.crs.to_dict()
        assert not origin if not crs else (crs["proj"], crs["lat_0"], crs["lon_0"], crs["k"]) == ("tmerc", *origin, 1)


def test_an_empty_map_has_no_file(tmp_path):
    empty = label_map([[0]], (0.5, 0.5))
    assert empty.areas() == [] and empty.areas_by_class() == [] and empty.to_array().shape == (0, 0)
    for write in (empty.to_tif, empty.to_asc):
        with pytest.raises(ValueError, match="no cells"):
            write(tmp_path / "map")
