"""Tests on a mission with both records, whose folder the environment variable SCENECAST_RECORD names."""

import os
import random
import warnings
from pathlib import Path

import numpy as np
import pytest

from scenecast import DamagedRecord, Mission, Record
from scenecast.cdr import Decoder

FOLDER = os.environ.get("SCENECAST_RECORD")
recorded = pytest.mark.skipif(not FOLDER, reason="SCENECAST_RECORD names no folder of a mission")
SIDES = ("operator", "vehicle")


@pytest.fixture(scope="module")
def mission():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return Mission.open(FOLDER)


def assert_versions(mission, side):
    versions = mission.versions(side)
    # Several versions may have one time: the last of them is the map then.
    for version in versions[np.append(np.diff(versions["time"]) > 0, True)] if len(versions) else []:
        found = mission.map(version["time"], side)
        assert (found.version, found.epoch) == (version["version"], version["epoch"])
        assert (len(found), found.fingerprint()) == (version["cells"], version["fingerprint"])


@recorded
@pytest.mark.parametrize("side", SIDES)
def test_each_version_of_the_map_has_its_cells_and_fingerprint(mission, side):
    assert len(mission.versions(side)) > 1
    assert_versions(mission, side)


@recorded
@pytest.mark.parametrize("side", SIDES)
def test_every_message_decodes_to_its_last_byte(mission, side):
    record = mission.records[side]
    for topic in record.index:
        decoder = record._decoders[topic]
        for time, _ in record.messages(topic):
            assert mission.begin <= time <= mission.end
            assert decoder.at == len(decoder.data), topic


@recorded
def test_the_map_is_the_same_in_all_forms(mission, tmp_path):
    found = mission.map()
    array = found.to_array()
    areas = found.areas()
    assert np.count_nonzero(array) == len(found) == sum(area["cells"] for area in areas)
    assert sum(area["area_m2"] for area in areas) == pytest.approx(len(found) * found.cell_m ** 2)
    # The surface receives the confidence with what the map leaves of the link.
    assert all(area["low_m2"] <= area["area_m2"] <= area["high_m2"] for area in areas)
    assert all(np.isnan(area["low_m2"]) for area in mission.map(side="vehicle").areas())
    found.to_asc(tmp_path / "map.asc")
    assert (np.loadtxt(tmp_path / "map.asc", skiprows=6)[::-1] == array).all()
    labels = pytest.importorskip("xarray") and found.to_xarray()
    assert (labels.values == array).all() and np.allclose(np.diff(labels.x), found.cell_m)


@recorded
def test_the_state_knows_the_map(mission):
    for time, _ in mission.records["operator"].messages("/scenecast/state"):
        shown = mission._vehicle_state(mission.state(time))["map"]
        found = mission.map(time)
        # The version that the page shows counts changes of layers, too.
        assert shown["version"] >= found.version
        assert (shown["explored_cells"], shown["cell_m"]) == (len(found), found.cell_m)
        assert not len(found) or (shown["x0"], shown["y0"]) == (found.x.min(), found.y.min())


@recorded
def test_the_tables_have_content(mission):
    assert np.isnan(mission.agreement(mission.begin - 1)) and 0 < mission.agreement() <= 1
    for side in SIDES:
        assert len(mission.link(side)) and len(mission.track(side)) and mission.frames(side) and mission.events(side)
    assert all(image["data"][:4] == b"RIFF" for image in mission.exemplars() if image["format"] == "webp")
    assert all(order["history"] for order in mission.orders())
    changes = mission.changes(side="vehicle")
    seen = changes[changes["frame"] > 0]
    assert len(seen) > len(changes) / 2 and (seen["frame"] <= seen["time"]).all() and (seen["words"] > 0).all()
    assert np.isnan(mission.changes()["frame"]).all() and len(mission.changes()) >= len(mission.map())
    assert any(frame["contents"].get("map") for frame in mission.frames())
    assert mission.state(mission.begin - 1) == {}


@recorded
@pytest.mark.parametrize("side, part", [("operator", "record_surface"), ("vehicle", "record_vehicle")])
def test_a_cut_file_loads_what_is_before_the_cut(mission, tmp_path, side, part):
    source = sorted((Path(FOLDER) / part).glob("*.mcap"))[0]
    content, cut = source.read_bytes(), tmp_path / "cut_0.mcap"
    whole, chance, most = Record(source), random.Random(1), 0
    for at in sorted(chance.sample(range(len(content) - 1), 50)):
        cut.write_bytes(content[:at])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = Record(cut)
        chunk_end = max([start + size for _, start, size, _ in whole._blocks if start + size <= at], default=0)
        expected = {topic: [entry for entry in entries if sum(whole._blocks[entry[1]][1:3]) <= chunk_end]
                    for topic, entries in whole.index.items()}
        assert found.index == {topic: entries for topic, entries in expected.items() if entries}
        # The file may be cut in the index behind its data: nothing is lost then.
        complete = found.index == whole.index
        assert complete or [warning.category for warning in caught] == [DamagedRecord]
        most = max(most, sum(map(len, found.index.values())))
        if f"/scenecast/{mission.name}/map_cells" in found.index:
            records = (found, None) if side == "operator" else (None, found)
            assert_versions(Mission(*records), side)
    assert most > 0


@recorded
def test_a_file_that_is_being_written_loads_its_finished_parts(tmp_path):
    source = sorted((Path(FOLDER) / "record_surface").glob("*.mcap"))[0]
    content, whole = source.read_bytes(), Record(source)
    _, start, size, _ = whole._blocks[-2]
    (tmp_path / "open_0.mcap").write_bytes(content[:start + size] + b"\x06" + b"\xff" * 8 + b"\0" * 44)
    with pytest.warns(DamagedRecord, match="not finished"):
        found = Record(tmp_path)
    assert found._blocks[-1][1] == start


@recorded
@pytest.mark.parametrize("side", SIDES)
def test_a_damaged_chunk_takes_only_its_own_messages(mission, tmp_path, side):
    whole = mission.records[side]
    chunk = [block for block in whole._blocks if block[3]][len(whole._blocks) // 2]
    file, at, size, _ = chunk
    data = bytearray(file.read_bytes())
    data[at + size // 2:at + size // 2 + 100] = bytes(byte ^ 0x55 for byte in data[at + size // 2:at + size // 2 + 100])
    (tmp_path / file.name).write_bytes(data)
    with pytest.warns(DamagedRecord, match="1 chunks are left out"):
        damaged = Record(tmp_path / file.name)
    lost = whole._blocks.index(chunk)
    own = {number for number, block in enumerate(whole._blocks) if block[0] == file}
    times = {topic: [entry[0] for entry in entries if entry[1] in own and entry[1] != lost] for topic, entries in whole.index.items()}
    assert {topic: [entry[0] for entry in entries] for topic, entries in damaged.index.items()} == {
        topic: found for topic, found in times.items() if found}


@recorded
def test_records_that_are_exchanged_are_refused():
    with pytest.raises(ValueError, match="record of a vehicle"):
        Mission.open(surface=Path(FOLDER) / "record_vehicle")


@recorded
def test_a_list_has_the_records_of_both_ends_in_any_order(mission):
    ends = [Path(FOLDER) / f"record_{end}" for end in ("vehicle", "surface")]
    assert Mission.open(ends).map().fingerprint() == mission.map().fingerprint()
    assert Mission.open(ends[:1]).records["operator"] is None
    # An end that was started again has several records: these are one twice.
    twice = Mission.open(ends + [str(ends[1])]).records["operator"]
    assert {topic: len(found) for topic, found in twice.index.items()} == {
        topic: 2 * len(found) for topic, found in mission.records["operator"].index.items()}
    assert all(found == sorted(found) for found in ([entry[0] for entry in entries] for entries in twice.index.values()))


def test_cdr_aligns_and_follows_the_order_of_bytes():
    text = "uint8 ONE=1\nuint8 a # first\nfloat64[2] b\nstring c\nTwo[] d\n"
    text += "=" * 80 + "\nMSG: some/Two\nint16 e\nstring<=5 f\n"
    body = b"\x07" + b"\0" * 7 + np.array([1.5, 2.5], ">f8").tobytes() + b"\0\0\0\x03hi\0"
    body += b"\0\0\0\0\x01" + b"\xff\xfe\0\0" + b"\0\0\0\x02x\0"
    found = Decoder(text, "some/msg/One").decode(b"\0\0\0\0" + body)
    assert (found.a, found.b.tolist(), found.c, found.d[0].e, found.d[0].f) == (7, [1.5, 2.5], "hi", -2, "x")
