"""Tests on a surface that is imitated here, and on the running one that the environment variable SCENECAST_URL names."""

import csv
import gzip
import io
import json
import os
import struct
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest

from scenecast import SurfaceError, open_surface
from scenecast.surface import read_tiles

URL, TOKEN = os.environ.get("SCENECAST_URL"), os.environ.get("SCENECAST_TOKEN")
live = pytest.mark.skipif(not URL, reason="SCENECAST_URL names no surface")

VEHICLE = {
    "id": 1, "name": "auv-1", "last_received_s": 98.0, "track": [[10.0, 1.0, 2.0], [90.0, 5.0, 6.0]],
    "map": {"epoch": 3, "earlier": None, "placement": {"version": 1, "east_m": 10.0, "north_m": -20.0}},
    "label_book": {"1": {"name": "sand", "colour": None, "merged_into": None}, "2": {"name": None, "colour": None, "merged_into": 1}},
    "labels": [{"id": 1, "name": "sand", "merged_into": None, "exemplar": {"images": [
        {"number": 7, "url": "/api/v2/vehicles/1/exemplars/1-7.webp", "at_s": 50.0, "taken_s": 40.0, "width_m": 0.3, "x_m": 1.0, "y_m": 2.0},
        {"number": 8, "url": "/api/v2/vehicles/1/exemplars/1-8.webp", "at_s": 60.0, "taken_s": None, "width_m": None, "x_m": None, "y_m": None}]}},
        {"id": 2, "name": None, "merged_into": 1, "exemplar": {"images": []}}],
    "status": {"at_s": 90.0, "x_m": 5.0, "y_m": 6.0, "z_m": -7.0, "heading_deg": 45.0, "sigma_m": 0.5},
    "link": {"up": {"loss": 0.25}, "round_trip_s": None, "backlog": {"bits": 800}},
    "directive": {"slots": [{"slot": "utility", "version": 4, "state": "on_air", "reason": None, "issued_s": 80.0, "changed_s": 81.0}]}}
STATE = {
    "now_s": 100.0, "mission": {"id": "a", "speed": 2.0, "origin": {"lat_deg": 43.5, "lon_deg": 7.25}}, "vehicles": [VEHICLE],
    "link": {"budget_bps": 10000, "down": {"bps_1min": 20.0}, "up": {"bps_1min": 30.0},
             "history": [{"t_s": 95, "down_bps": 1.0, "up_bps": 2.0}]}}
LOG = {"entries": [{"at_s": 50.0, "vehicle": 1, "kind": "order", "by": "anna", "text": "utility version 4"}]}
DATE, NOW = "Thu, 01 Jan 2026 12:00:00 GMT", 1767268800.0


def tiles(form=1):
    """A tile in column -1 and row 0: two labels, of which the second has a confidence of the third level."""
    index = {"cell_m": 0.25, "version": 9, "at_s": 100.0, "tiles": [[-1, 0]],
             "layers": [{"name": "confidence", "unit": "", "lowest": 1, "edges": [0.0, 0.25, 0.5, 0.75, 1.0]}]}
    text = json.dumps(index).encode()
    text += b" " * (-len(text) % 4)
    labels = struct.pack("<BBBBBBH", 0, 62, 5, 2, 2, 1, 1) + struct.pack("<I", 40) + b"\1\1\0\1" + b"\1\2\0\1"
    confidence = struct.pack("<BBBBBBH", 1, 63, 5, 1, 1, 2, 1) + struct.pack("<I", 40) + b"\1\0\3" + b"\0"
    return struct.pack("<4sB3xI", b"SCMT", form, len(text)) + text + struct.pack("<I", 2) + labels + confidence


@pytest.fixture
def fake():
    """A server whose answers are a dict from path to (status, body, headers) or body."""
    answers = {"/api/v2/state": STATE, "/api/v2/log": LOG, "/api/v2/vehicles/1/map/tiles": tiles(),
               "/api/v2/vehicles/1/exemplars/1-7.webp": b"RIFF", "/api/v2/vehicles/1/map.utm.tif": b"II*"}
    seen = []

    class Handler(BaseHTTPRequestHandler):
        def version_string(self):
            return "fake"

        def date_time_string(self, timestamp=None):
            return DATE

        def log_message(self, *_):
            pass

        def do_GET(self):
            seen.append((self.path, dict(self.headers)))
            answer = answers.get(self.path, (404, {"error": "there is no such page"}, {}))
            status, body, headers = answer if isinstance(answer, tuple) else (200, answer, {})
            body = body if isinstance(body, bytes) else json.dumps(body).encode()
            self.send_response(status)
            for name, value in {"Content-Length": len(body), **headers}.items():
                self.send_header(name, str(value))
            self.end_headers()
            self.wfile.write(body)

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    answers["url"], answers["seen"] = f"http://127.0.0.1:{server.server_port}", seen
    yield answers
    server.shutdown()
    server.server_close()


def test_a_map_has_labels_names_place_and_confidence(fake):
    found = open_surface(fake["url"]).map()
    assert sorted(zip(found.x, found.y, found.label)) == [(-2, 5, 1), (-1, 5, 2), (-1, 6, 1)]
    confidence = {(x, y): tuple(level) for x, y, level in zip(found.x, found.y, found.layers["confidence"].tolist())}
    assert confidence[-1, 5] == (0.5, 0.75) and np.isnan(confidence[-2, 5]).all() and np.isnan(confidence[-1, 6]).all()
    assert (found.epoch, found.version, found.time, found.origin) == (3, 9, NOW, (43.5, 7.25))
    assert [axis[0] for axis in found.axes()] == [-1.5 * 0.25 + 10, 5.5 * 0.25 - 20]
    assert {area["class"]: area["cells"] for area in found.areas_by_class()} == {"sand": 3}
    assert all(area["low_m2"] < area["area_m2"] < area["high_m2"] for area in found.areas())


def test_the_tables_are_those_of_a_record(fake):
    surface = open_surface(fake["url"], name="auv-1")
    assert (surface.name, surface.vehicles) == ("auv_1", ["auv_1"])
    # Mission time runs twice as fast as the clock.
    assert surface.orders() == [{"slot": "utility", "version": 4, "given": NOW - 10,
                                 "history": [(NOW - 9.5, "operator", "on air", None)]}]
    link, track = surface.link(), surface.track()
    assert link["time"].tolist() == [NOW - 2.5, NOW] and link["sent_bps"].tolist() == [1.0, 20.0]
    assert (link["loss"][1], link["age_s"][1], link["backlog_bits"][1]) == (0.25, 2.0, 800) and np.isnan(link["round_trip_s"][1])
    assert track["x_m"].tolist() == [11.0, 15.0] and track["y_m"].tolist() == [-18.0, -14.0]
    assert np.isnan(track["z_m"][0]) and track["z_m"][1] == -7 and track["time"][1] == NOW - 5
    assert surface.events() == [{"time": NOW - 25, "vehicle": "auv-1", "level": "info", "source": "order",
                                 "text": "anna: utility version 4"}]
    versions = surface.versions()
    assert versions["cells"].tolist() == [3] and versions["fingerprint"][0] == surface.map().fingerprint()


def test_one_of_several_vehicles_is_named(fake):
    fake["/api/v2/state"] = {**STATE, "vehicles": [VEHICLE, {**VEHICLE, "id": 2, "name": "auv-2"}]}
    fake["/api/v2/vehicles/2/map/tiles"] = tiles()
    with pytest.raises(ValueError, match="auv_1, auv_2"):
        open_surface(fake["url"])
    assert len(open_surface(fake["url"], name="auv-2").map()) == 3
    assert fake["seen"][-2][0] == "/api/v2/vehicles/2/map/tiles"
    fake["/api/v2/state"] = {**STATE, "vehicles": []}
    with pytest.raises(SurfaceError, match="no vehicle"):
        open_surface(fake["url"]).map()


def test_an_image_that_was_replaced_meanwhile_is_left_out(fake):
    image, = open_surface(fake["url"]).exemplars()
    assert image == {"label": 1, "number": 7, "name": "sand", "epoch": 3, "time": NOW - 25, "taken": NOW - 30,
                     "width_m": 0.3, "middle_m": (1.0, 2.0), "format": "webp", "data": b"RIFF"}


def test_a_file_is_saved_by_its_ending(fake, tmp_path):
    surface = open_surface(fake["url"])
    surface.save(tmp_path / "reef.utm.tif")
    assert (tmp_path / "reef.utm.tif").read_bytes() == b"II*"
    with pytest.raises(ValueError, match="must end in one of utm.tif"):
        surface.save(tmp_path / "reef.jpg")
    with pytest.raises(SurfaceError, match="404"):
        surface.save(tmp_path / "reef.ply")
    assert not (tmp_path / "reef.ply").exists()


def test_what_a_surface_does_not_have_is_refused_with_the_remedy(fake):
    surface = open_surface(fake["url"])
    for call, why in ((lambda: surface.map(side="vehicle"), "vehicle's record"), (lambda: surface.map(NOW), "earlier ones"),
                      (surface.frames, "record"), (surface.agreement, "records of both"), (lambda: surface.link("vehicle"), "alone")):
        with pytest.raises(ValueError, match=why):
            call()
    with pytest.raises(ValueError, match="one of the vehicles: auv_1"):
        open_surface(fake["url"], name="auv-2")


def test_answers_may_be_compressed(fake):
    fake["/api/v2/state"] = 200, gzip.compress(json.dumps(STATE).encode()), {"Content-Encoding": "gzip"}
    assert open_surface(fake["url"]).state() == STATE


def test_a_token_goes_to_the_surface_alone(fake):
    open_surface(fake["url"], token="secret\n")
    assert fake["seen"][-1][1]["Authorization"] == "Bearer secret"
    fake["/api/v2/state"] = 302, b"", {"Location": fake["url"] + "/elsewhere"}
    with pytest.raises(SurfaceError, match="302"):
        open_surface(fake["url"], token="secret")
    assert fake["seen"][-1][0] == "/api/v2/state"


@pytest.mark.parametrize("status, error, remedy", [
    (401, "this requires a token", "open_surface\\(url, token="), (403, "this page is served to this machine only", "role of the token"),
    (404, "there is no such page", "another version"), (503, "the mission has not begun", "has not begun")])
def test_refusals_have_the_surfaces_reason_and_a_remedy(fake, status, error, remedy):
    fake["/api/v2/state"] = status, {"error": error}, {}
    with pytest.raises(SurfaceError, match=remedy) as refused:
        open_surface(fake["url"])
    assert refused.value.status == status and error in str(refused.value)


def test_no_surface_no_answer_and_wrong_addresses_are_told(fake):
    for url in ("http://127.0.0.1:1", "http://name.invalid", "127.0.0.1:8460", "ftp://127.0.0.1", "http://127.0.0.1:port", ""):
        with pytest.raises(SurfaceError):
            open_surface(url, timeout_s=5)
    with pytest.raises(SurfaceError):
        open_surface(fake["url"], token="two\nlines")
    fake["/api/v2/state"] = b"<html>a router</html>"
    with pytest.raises(SurfaceError, match="no JSON"):
        open_surface(fake["url"])


def test_a_surface_that_hangs_is_given_up():
    with ThreadingHTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as silent:
        # Nobody accepts the connection.
        with pytest.raises(SurfaceError, match="timed out"):
            open_surface(f"http://127.0.0.1:{silent.server_port}", timeout_s=0.2)


@pytest.mark.parametrize("state", [[], {}, {"now_s": 1}, {**STATE, "vehicles": [{"name": "auv-1"}]}, {**STATE, "mission": {}},
                                   {**STATE, "vehicles": None}, {**STATE, "now_s": None}])
def test_states_of_other_versions_are_told(fake, state):
    fake["/api/v2/state"] = state
    with pytest.raises(SurfaceError, match="another version"):
        open_surface(fake["url"])


@pytest.mark.parametrize("lost", ["status", "link", "directive", "labels", "track"])
def test_members_that_are_missing_are_told(fake, lost):
    surface = open_surface(fake["url"])
    fake["/api/v2/state"] = {**STATE, "vehicles": [{key: value for key, value in VEHICLE.items() if key != lost}]}
    call = {"status": surface.track, "link": surface.link, "directive": surface.orders, "labels": surface.exemplars,
            "track": surface.track}[lost]
    with pytest.raises(SurfaceError, match="another version"):
        call()


def test_answers_that_are_cut_off_are_told(fake):
    surface = open_surface(fake["url"])
    whole = json.dumps(STATE).encode()
    fake["/api/v2/state"] = 200, whole[:100], {"Content-Length": len(whole)}
    with pytest.raises(SurfaceError, match="cut off"):
        surface.state()
    packed = gzip.compress(whole)
    for cut in (0, 5, 50, len(packed) - 1):
        fake["/api/v2/state"] = 200, packed[:cut], {"Content-Encoding": "gzip"}
        with pytest.raises(SurfaceError, match="cut off|no JSON"):
            surface.state()


def test_tiles_that_are_cut_off_or_of_another_format_are_told():
    whole = tiles()
    assert read_tiles(whole)
    for at in range(len(whole) - 3):
        with pytest.raises(SurfaceError, match="cut off|format"):
            read_tiles(whole[:at])
    with pytest.raises(SurfaceError, match="another format"):
        read_tiles(tiles(form=2))


def test_a_map_that_begins_anew_while_it_is_read_is_read_again(fake):
    surface = open_surface(fake["url"])
    states = iter([STATE] + [{**STATE, "vehicles": [{**VEHICLE, "map": {**VEHICLE["map"], "epoch": 4}}]}] * 3)
    read = surface._json
    surface._json = lambda path: (next(states), {"Date": DATE}) if path == "/api/v2/state" else read(path)
    assert surface.map().epoch == 4
    numbers = iter(range(100))
    surface._json = lambda path: ({**STATE, "mission": {**STATE["mission"], "id": next(numbers)}}, {"Date": DATE})
    with pytest.raises(SurfaceError, match="read it again"):
        surface.map()


@pytest.fixture(scope="module")
def surface():
    return open_surface(URL, TOKEN)


@live
def test_the_map_is_that_of_the_programs_own_table(surface, tmp_path):
    for _ in range(20):
        found = surface.map()
        surface.save(tmp_path / "map.csv")
        rows = list(csv.DictReader(io.StringIO((tmp_path / "map.csv").read_text(encoding="utf-8"))))
        if surface.map().version == found.version:
            break
    assert len(rows) == len(found) > 0
    middles = {name: bounds.mean(axis=1) for name, bounds in found.layers.items()}
    assert "confidence" in middles
    east, north = ((cells + 0.5) * found.cell_m + shift for cells, shift in zip((found.x, found.y), found.placement_m))
    mine = {(round(e, 3), round(n, 3)): at for at, (e, n) in enumerate(zip(east.tolist(), north.tolist()))}
    for row in rows:
        at = mine[float(row["east_m"]), float(row["north_m"])]
        assert int(row["label"]) == found.label[at]
        for name, values in middles.items():
            assert np.isnan(values[at]) if not row[name] else float(row[name]) == pytest.approx(values[at], abs=1e-3)


@live
def test_the_state_has_the_areas_of_the_map(surface):
    for _ in range(20):
        found, vehicle = surface.map(), surface._vehicle()[1]
        if vehicle["map"]["version"] == found.version:
            break
    assert {area["label"]: area["area_m2"] for area in found.areas()} == pytest.approx(
        {label["id"]: label["area_m2"] for label in vehicle["labels"] if label["cells"]})
    assert all(0 <= area["low_m2"] < area["high_m2"] <= len(found) * found.cell_m ** 2 for area in found.areas())


@live
def test_a_running_surface_has_tables_images_and_files(surface, tmp_path):
    assert len(surface.link()) > 1 and len(surface.track()) and surface.events() and surface.orders()
    images = surface.exemplars()
    assert images and all(image["data"][:4] == b"RIFF" for image in images)
    for name in ("map.geojson", "map.tif"):
        surface.save(tmp_path / name)
    assert json.loads((tmp_path / "map.geojson").read_text(encoding="utf-8"))["features"]
    with pytest.raises(SurfaceError, match="status 422|status 4") as refused:
        surface.save(tmp_path / "map.utm.tif") if surface.map().origin is None else surface._get("/api/v2/nothing")
    assert 400 <= refused.value.status < 500


@live
def test_a_surface_of_another_version_is_told(surface):
    with pytest.raises(SurfaceError, match="another version"):
        open_surface(f"{URL}/elsewhere", TOKEN)
