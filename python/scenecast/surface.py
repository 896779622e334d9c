"""A live surface, read through the HTTP interface of the operator's page (docs/reference/http.md)."""

import functools
import gzip
import http.client
import json
import struct
import time
import urllib.error
import urllib.request
import zlib
from email.utils import parsedate_to_datetime
from pathlib import Path

import numpy as np

from .label_map import LabelMap, described, keys, level_bounds
from .mission import LINK, TRACK, VERSION, part_of

REMEDY = {401: "give the token: open_surface(url, token=...)",
          403: "the address must be one that the surface knows, and the role of the token must allow it",
          404: "the surface is of another version than 2 of the interface, or it has no such vehicle, label or image"}
FILES = ("utm.tif", "wgs84.tif", "tif", "png", "geojson", "coco.json", "taglab.json", "labels.csv", "csv", "ply")
TILE = 64
NAN = float("nan")


class SurfaceError(Exception):
    """A surface did not answer, or not as this package understands it; `status` is that of HTTP, or None."""

    def __init__(self, text, status=None):
        super().__init__(text)
        self.status = status


class _Stay(urllib.request.HTTPRedirectHandler):
    """Follows no redirection: a token must not go elsewhere."""

    def redirect_request(self, *_):
        return None


def _expects(call):
    """Tells of members that an answer does not have."""
    @functools.wraps(call)
    def wrapped(self, *arguments, **named):
        try:
            return call(self, *arguments, **named)
        except KeyError as error:
            raise SurfaceError(f"{self.url}: an answer has no {error}: the surface is of another version") from error
    return wrapped


def open_surface(url="http://127.0.0.1:8460", token=None, name=None, timeout_s=30):
    """Opens a running surface; `token` is the text of a token, `name` selects one of several vehicles."""
    return Surface(url, token, name, timeout_s)


def read_tiles(data):
    """The index of map tiles and, by number of the layer, columns, rows and values of its known cells."""
    try:
        magic, form, size = struct.unpack_from("<4sB3xI", data)
        if (magic, form) != (b"SCMT", 1):
            raise SurfaceError("the map is in another format than 1: this package and the surface differ in version")
        index, at, cells = json.loads(data[12:12 + size]), 12 + size, {}
        for column, row in index["tiles"]:
            parts, = struct.unpack_from("<I", data, at)
            at += 4
            for _ in range(parts):
                layer, west, south, width, height, wide, times = struct.unpack_from("<BBBBBBH", data, at)
                first, count = at + 8 + 4 * times + wide * width * height, width * height
                values = np.frombuffer(data, np.uint8, count, first).reshape(height, width)
                y, x = np.nonzero(values)
                place = x + west + TILE * column, y + south + TILE * row
                cells.setdefault(layer, []).append((*place, values[y, x]))
                at = first + count + -(first + count) % 4
    except (struct.error, ValueError, KeyError, TypeError) as error:
        raise SurfaceError(f"the map is cut off or damaged: {error}") from error
    joined = {layer: [np.concatenate(arrays) for arrays in zip(*found)] for layer, found in cells.items()}
    return index, joined


class Surface:
    """A vehicle as a running surface knows it, with the calls of a `Mission`; every call reads the present state.

    Times are seconds of UTC since 1970 by the clock of the surface, to a second.
    """

    def __init__(self, url, token=None, name=None, timeout_s=30):
        """Reads the state once, so that a surface that does not answer is noticed here."""
        self.url, self.timeout_s = url.rstrip("/"), timeout_s
        self._token = token.strip() if token else None
        # Surfaces are on this machine or in its network: no proxy knows them.
        self._opener = urllib.request.build_opener(urllib.request.ProxyHandler({}), _Stay)
        self.vehicles = sorted(self._read()[1])
        names = {part_of(name)} if name else set(self.vehicles)
        if len(names) > 1 or names - set(self.vehicles):
            raise ValueError(f"give the name of one of the vehicles: {', '.join(self.vehicles)}")
        self.name = next(iter(names), "")

    def _get(self, path):
        """The body and the headers of an answer."""
        headers = {"Accept-Encoding": "gzip", "X-Scenecast-Client": "python"}
        if self._token:
            headers["Authorization"] = f"Bearer {self._token}"
        try:
            request = urllib.request.Request(self.url + path, headers=headers)
            with self._opener.open(request, timeout=self.timeout_s) as answer:
                body, head = answer.read(), answer.headers
            return (gzip.decompress(body) if head.get("Content-Encoding") == "gzip" else body), head
        except urllib.error.HTTPError as error:
            with error:
                raise self._refusal(error) from None
        except (http.client.IncompleteRead, EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise SurfaceError(f"{self.url}{path}: the answer was cut off: {error}") from error
        except (OSError, http.client.HTTPException) as error:
            reason = getattr(error, "reason", error)
            raise SurfaceError(f"{self.url} does not answer as a surface: {reason}") from error
        except ValueError as error:
            raise SurfaceError(f"{self.url}: the address or the token is not valid: {error}") from error

    def _refusal(self, error):
        try:
            line = json.loads(error.read())["error"]
        except (ValueError, KeyError, TypeError, OSError, http.client.HTTPException):
            line = error.reason
        remedy = f" ({REMEDY[error.code]})" if error.code in REMEDY else ""
        return SurfaceError(f"{error.url}: status {error.code}: {line}{remedy}", error.code)

    def _json(self, path):
        body, head = self._get(path)
        try:
            return json.loads(body), head
        except ValueError as error:
            raise SurfaceError(f"{self.url}{path}: the answer is no JSON: is this a surface of scenecast?") from error

    def _read(self):
        """The state, the part of it that is about the vehicle, and the function from mission time to UTC."""
        state, head = self._json("/api/v2/state")
        try:
            now, speed = float(state["now_s"]), max(float(state["mission"]["speed"]), 1e-3)
            known = {part_of(vehicle["name"]): vehicle for vehicle in state["vehicles"] if vehicle["map"] and vehicle["id"]}
        except (KeyError, TypeError, ValueError) as error:
            raise SurfaceError(f"{self.url}: the state is not as expected ({error!r}): it is of another version") from error
        date = head.get("Date")
        unix = parsedate_to_datetime(date).timestamp() if date else time.time()
        return state, known, lambda at_s: NAN if at_s is None else unix - (now - at_s) / speed

    def _vehicle(self):
        state, known, utc = self._read()
        if self.name not in known:
            raise SurfaceError(f"{self.url}: the surface knows no vehicle {self.name}")
        return state, known[self.name], utc

    def state(self):
        """The present state, as `/api/v2/state`."""
        return self._read()[0]

    @_expects
    def map(self, t=None, side="operator"):
        """The present map of the operator, with the layers that have been received."""
        self._only(side, t)
        for _ in range(5):
            before = self._vehicle()
            path = f"/api/v2/vehicles/{before[1]['id']}/map/tiles"
            index, cells = read_tiles(self._get(path)[0])
            state, vehicle, utc = self._vehicle()
            if self._place_of(*before[:2]) == self._place_of(state, vehicle):
                break
        else:
            raise SurfaceError(f"{self.url}: the map began anew while it was read: read it again")
        none = np.zeros(0, int), np.zeros(0, int), np.zeros(0, "u1")
        x, y, label = cells.get(0, none)
        order = np.argsort(keys(x, y))
        x, y, label = x[order], y[order], label[order]
        layers = {layer["name"]: level_bounds(layer, keys(x, y), cells.get(number)) for number, layer in enumerate(index["layers"], 1)}
        units = {layer["name"]: layer["unit"] for layer in index["layers"]}
        epoch = vehicle["map"]["epoch"]
        return LabelMap(x.astype("i4"), y.astype("i4"), label, index["cell_m"], epoch, index["version"],
                        utc(index["at_s"]), side, **described(state, vehicle, epoch, side), layers=layers, units=units)

    @staticmethod
    def _place_of(state, vehicle):
        """What must not change while a map is read."""
        shown = vehicle["map"]
        return state["mission"].get("id"), shown["epoch"], (shown.get("earlier") or {}).get("run"), shown.get("placement")

    @staticmethod
    def _only(side, t=None):
        if side != "operator":
            raise ValueError("a surface has the operator's side alone: open the vehicle's record for its own")
        if t is not None:
            raise ValueError("a surface has the present map alone: open its record for earlier ones")

    def versions(self, side="operator"):
        """The present version of the map, as a table with one row."""
        self._only(side)
        found = self.map()
        return np.array([(found.time, found.epoch, found.version, len(found), found.fingerprint())], VERSION)

    @_expects
    def exemplars(self):
        """The images of labels that the surface keeps, at most eight a label, as those of a record."""
        _, vehicle, utc = self._vehicle()
        found = []
        for label in vehicle["labels"]:
            for image in label["exemplar"]["images"]:
                try:
                    data, _ = self._get(image["url"])
                except SurfaceError as error:
                    # A newer image has taken its place meanwhile.
                    if error.status == 404:
                        continue
                    raise
                found.append({"label": label["id"], "number": image["number"], "name": label.get("name"),
                              "epoch": vehicle["map"]["epoch"], "time": utc(image["at_s"]),
                              "taken": None if image["taken_s"] is None else utc(image["taken_s"]),
                              "width_m": image["width_m"],
                              "middle_m": None if image["x_m"] is None else (image["x_m"], image["y_m"]),
                              "format": "webp", "data": data})
        return found

    @_expects
    def orders(self):
        """The latest order of each slot; its history has the present status alone."""
        _, vehicle, utc = self._vehicle()
        orders = [{"slot": slot["slot"], "version": slot["version"], "given": utc(slot["issued_s"]),
                   "history": [(utc(slot["changed_s"]), "operator", slot["state"].replace("_", " "), slot["reason"])]}
                  for slot in vehicle["directive"]["slots"]]
        return sorted(orders, key=lambda order: (order["given"], order["slot"]))

    @_expects
    def link(self, side="operator"):
        """The link: the rates of 5 s each over the last 20 minutes, of all vehicles, and a last row with the present state.

        Of the last row the rates are those of the last minute, as in a record; what a row does not know is NaN.
        """
        self._only(side)
        state, vehicle, utc = self._vehicle()
        link, channel = state["link"], vehicle["link"]
        rows = [(utc(row["t_s"]), NAN, row["down_bps"], row["up_bps"], NAN, NAN, NAN, NAN) for row in link["history"]]
        heard, backlog = vehicle["last_received_s"], channel["backlog"]
        rows.append((utc(state["now_s"]), link["budget_bps"], link["down"]["bps_1min"], link["up"]["bps_1min"],
                     channel["up"]["loss"], NAN if channel["round_trip_s"] is None else channel["round_trip_s"],
                     NAN if heard is None else state["now_s"] - heard, NAN if backlog is None else backlog["bits"]))
        return np.array(rows, [(name, "f8") for name in ("time", *LINK)])

    @_expects
    def track(self, side="operator"):
        """The last 500 reports in the world frame; depth, heading and sigma of the last one alone, NaN before."""
        self._only(side)
        state, vehicle, utc = self._vehicle()
        east, north = described(state, vehicle, None, side)["placement_m"]
        rows = [(utc(at_s), x + east, y + north, NAN, NAN, NAN) for at_s, x, y in vehicle["track"]]
        status = vehicle["status"]
        if status:
            last = (utc(status["at_s"]), status["x_m"] + east, status["y_m"] + north, status["z_m"], status["heading_deg"],
                    status["sigma_m"])
            rows = [row for row in rows if row[0] < last[0]] + [last]
        return np.array(rows, [(name, "f8") for name in TRACK])

    @_expects
    def events(self, side="operator"):
        """The last 2000 entries of the page's log."""
        self._only(side)
        state, _, utc = self._read()
        names = {vehicle["id"]: vehicle["name"] for vehicle in state["vehicles"]}
        entries = self._json("/api/v2/log")[0]["entries"]
        return [{"time": utc(entry["at_s"]), "vehicle": names.get(entry["vehicle"], ""), "level": "info",
                 "source": entry["kind"], "text": f"{entry['by']}: {entry['text']}" if entry["by"] else entry["text"]}
                for entry in entries]

    def frames(self, side="operator"):
        """A surface does not serve its frames: its record has them."""
        raise ValueError("a surface does not serve its frames: open its record")

    def agreement(self, t=None):
        """A surface does not have the vehicle's map: the records of both ends have both."""
        raise ValueError("a surface does not have the vehicle's map: open the records of both ends")

    def save(self, path):
        """Writes a file that the surface makes of the present map, by its ending: see FILES."""
        kind = next((kind for kind in FILES if str(path).endswith(f".{kind}")), None)
        if kind is None:
            raise ValueError(f"{path}: the name must end in one of {', '.join(FILES)}")
        _, vehicle, _ = self._vehicle()
        Path(path).write_bytes(self._get(f"/api/v2/vehicles/{vehicle['id']}/map.{kind}")[0])
