"""A mission as both ends recorded it."""

import json
import re
from pathlib import Path

import numpy as np

from .label_map import LabelMap, described, keys, level_bounds
from .record import Record

STATUS = ("queued", "on air", "received", "applied", "refused", "withdrawn")
DIRECTION = ("sent", "received", "dropped")
LEVEL = {20: "info", 30: "warning", 40: "error"}
LINK = ("budget_bps", "sent_bps", "received_bps", "loss", "round_trip_s", "age_s", "backlog_bits")
VERSION = [("time", "f8"), ("epoch", "u4"), ("version", "u8"), ("cells", "u4"), ("fingerprint", "u2")]
FRAME = ("frame", "camera_x_m", "camera_y_m", "camera_z_m", "camera_heading_deg")
CHANGE = [("time", "f8"), ("version", "u8"), ("x", "i4"), ("y", "i4"), ("label", "u1"), *((name, "f8") for name in FRAME),
          ("words", "u4"), ("confidence", "f4")]
TRACK = ("time", "x_m", "y_m", "z_m", "heading_deg", "sigma_m")


def _place(pose):
    """Metres east, north and up, and degrees from north."""
    at, turn = pose.position, pose.orientation
    return at.x, at.y, at.z, (90 - np.degrees(2 * np.arctan2(turn.z, turn.w))) % 360


def _record(path):
    return None if path is None else path if isinstance(path, Record) else Record(path)


def _both(folder):
    """The records of surface and vehicle in a folder, as `sim` and `demo` make it; the folder itself if it is one record."""
    if not folder.is_dir() or any(folder.glob("*.mcap")):
        return folder, None
    found = sorted(part for part in folder.iterdir() if part.is_dir() and any(part.glob("*.mcap")))
    surfaces = [part for part in found if part.name == "record_surface" or part.name.startswith("surface-")]
    vehicles = [part for part in found if part not in surfaces]
    if len(surfaces) > 1 or len(vehicles) > 1:
        raise ValueError(f"{folder} has several records of one end: give those of one mission")
    return next(iter(surfaces), None), next(iter(vehicles), None)


def _ends(paths):
    """The records of surface and vehicle among several; those of one end, which was started again, are joined."""
    records = [_record(path) for path in paths]
    ends = ([record for record in records if _is_of_vehicle(record) == is_of_vehicle] for is_of_vehicle in (False, True))
    return tuple(Record([record.path for record in end]) if len(end) > 1 else next(iter(end), None) for end in ends)


def _is_of_vehicle(record):
    return any(f"/scenecast/{found}/events" in record.index for found in _vehicles(record))


def _in_force(changes):
    """Columns, rows and values of the known cells after some changes: the last one of each cell is in force."""
    x, y, value = (np.concatenate(arrays) for arrays in zip(*changes)) if changes else (np.zeros(0, "i4"),) * 3
    _, last = np.unique(keys(x, y)[::-1], return_index=True)
    last = len(x) - 1 - last
    last = last[value[last] != 0]
    return x[last], y[last], value[last].astype("u1")


def part_of(name):
    """The part of a topic that stands for a vehicle."""
    part = re.sub(r"[^0-9A-Za-z]", "_", name)[:64]
    return part if part[:1] and not part[0].isdigit() else f"_{part}"


def _vehicles(record):
    found = (re.fullmatch(r"/scenecast/(\w+)/\w+", topic) for topic in (record.index if record else ()))
    return {match[1] for match in found if match}


class Mission:
    """A mission of one vehicle, as one end or both recorded it; times are seconds of UTC since 1970."""

    @classmethod
    def open(cls, surface=None, vehicle=None, name=None):
        """Opens one or two records, a folder with both, or a list of records, of which several may be of one end that was started
        again; `name` selects one of several vehicles."""
        if isinstance(surface, (list, tuple)) and vehicle is None:
            surface, vehicle = _ends(surface)
        elif surface is not None and vehicle is None and not isinstance(surface, Record):
            surface, vehicle = _both(Path(surface))
        return cls(_record(surface), _record(vehicle), name)

    def __init__(self, surface, vehicle, name=None):
        """A mission of these records, of which one may be None."""
        self.records = {"operator": surface, "vehicle": vehicle}
        present = [record for record in (surface, vehicle) if record]
        if not present:
            raise ValueError("give the record of the surface, that of the vehicle, or both")
        if surface and _is_of_vehicle(surface):
            raise ValueError(f"{surface.path} is the record of a vehicle: Mission.open(vehicle=...)")
        self.vehicles = sorted(_vehicles(surface) | _vehicles(vehicle))
        names = {part_of(name)} if name else _vehicles(vehicle) or _vehicles(surface)
        if len(names) > 1 or names - set(self.vehicles):
            raise ValueError(f"give the name of one of the vehicles: {', '.join(self.vehicles)}")
        self.name = next(iter(names), "")
        self.begin = float(np.nanmin([record.begin for record in present]))
        self.end = float(np.nanmax([record.end for record in present]))

    def _side(self, side):
        if side not in self.records:
            raise ValueError('side is "operator" or "vehicle"')
        if self.records[side] is None:
            raise ValueError(f"the record of the {'surface' if side == 'operator' else 'vehicle'} is missing")
        return self.records[side]

    def _messages(self, side, topic, until=None):
        return self._side(side).messages(f"/scenecast/{self.name}/{topic}", until)

    def state(self, t=None):
        """The state that the page showed last up to a time, as `/api/v2/state`; empty before the first one."""
        record = self.records["operator"]
        found = record.last("/scenecast/state", t) if record else None
        return json.loads(found[1].data) if found else {}

    def _vehicle_state(self, state):
        """The part of a state that is about the vehicle."""
        named = [found for found in state.get("vehicles", ()) if part_of(found["name"]) == self.name]
        return named[0] if named else {}

    def versions(self, side="operator"):
        """The versions of an end's map: time in s, epoch, version, number of cells and fingerprint of each."""
        rows = [(t, m.epoch, m.version, m.cells, m.digest) for t, m in self._messages(side, "map_version")]
        return np.array(rows, VERSION)

    def map(self, t=None, side="operator"):
        """The map of an end at a time, by default its last one."""
        parts, cell_m, epoch = {}, float("nan"), 0
        for _, change in self._messages(side, "map_cells", t):
            known = parts.setdefault(change.layer, [])
            # Without its first files, a record has changes of a map that it does not have.
            if not (known or change.whole):
                continue
            if change.whole:
                known.clear()
            known.append((change.x, change.y, change.value))
            if not change.layer:
                if change.epoch != epoch:
                    parts = {"": known}
                cell_m, epoch = change.cell_m, change.epoch
        found = self._side(side).last(f"/scenecast/{self.name}/map_version", t)
        time, version = (found[0], found[1].version) if found else (float("nan"), 0)
        x, y, label = _in_force(parts.pop("", []))
        meanings = {layer["name"]: layer for layer in map(json.loads, (m.data for _, m in self._messages(side, "layers", t)))}
        layers = {name: level_bounds({**meanings[name], "lowest": 1}, keys(x, y), _in_force(cells))
                  for name, cells in parts.items() if name in meanings}
        state = self.state(t)
        return LabelMap(x, y, label, cell_m, epoch, version, time, side, **described(state, self._vehicle_state(state), epoch, side),
                        layers=layers, units={name: meanings[name]["unit"] for name in layers})

    def changes(self, t=None, side="operator"):
        """Every change of a cell's label up to a time: when, in which version of the map, which cell, and its label since then.

        Of the vehicle's map also when the camera frame was taken after which it changed, where the camera was (m east, north and up,
        degrees from north), how many words the cell had, and how sure its label was; 0 and NaN where no frame of that run changed it.
        The camera saw a cell that is new; what a frame teaches may change known cells anywhere.
        """
        found = []
        for _, m in self._messages(side, "map_cells", t):
            if m.layer or not len(m.x):
                continue
            rows = np.zeros(len(m.x), CHANGE)
            rows["time"], rows["version"] = m.header.stamp, m.version
            rows["x"], rows["y"], rows["label"] = m.x, m.y, m.value
            for name in (*FRAME, "confidence"):
                rows[name] = np.nan
            if m.frames:
                frames = np.array([(f.taken, *_place(f.camera)) for f in m.frames])
                known = m.frame < len(frames)
                for column, name in enumerate(FRAME):
                    rows[name][known] = frames[m.frame[known], column]
                rows["words"], rows["confidence"] = m.words, m.confidence
            found.append(rows)
        return np.concatenate(found) if found else np.zeros(0, CHANGE)

    def agreement(self, t=None):
        """The share, 0 to 1, of the vehicle's cells whose label the operator's map has too; NaN without cells."""
        vehicle, operator = self.map(t, "vehicle"), self.map(t, "operator")
        if not len(vehicle):
            return float("nan")
        known = {} if vehicle.epoch != operator.epoch else dict(
            zip(zip(operator.x.tolist(), operator.y.tolist()), operator.label.tolist()))
        cells = zip(vehicle.x.tolist(), vehicle.y.tolist(), vehicle.label.tolist())
        return sum(known.get((x, y)) == label for x, y, label in cells) / len(vehicle)

    def exemplars(self):
        """The images of labels: label, number, name as last given, epoch, time of arrival, format and bytes of the file;
        when it was taken, its width on the sea floor in metres, and its middle in the world frame, each None where it is not known."""
        vehicle, images = self._vehicle_state(self.state()), {}
        names = {found["id"]: found["name"] for found in vehicle.get("labels", ())}
        for _, m in self._messages("operator", "exemplars"):
            name = names.get(m.label) if (vehicle.get("map") or {}).get("epoch") == m.epoch else None
            images[m.epoch, m.label, m.image] = {
                "label": m.label, "number": m.image, "name": name or m.name or None, "epoch": m.epoch,
                "time": m.header.stamp, "taken": m.taken if m.taken else None,
                "width_m": m.width_m if m.width_m > 0 else None,
                "middle_m": (m.middle.x, m.middle.y) if m.width_m > 0 else None,
                "format": m.format, "data": m.data.tobytes()}
        return list(images.values())

    def orders(self):
        """The orders: slot, version, time at which it was given, and its history of (time, side, status, reason)."""
        orders = {}
        for side in (side for side, record in self.records.items() if record):
            for _, m in self._messages(side, "order_status"):
                new = {"slot": m.slot, "version": m.version, "given": None, "history": []}
                order = orders.setdefault((m.slot, m.version), new)
                order["given"] = order["given"] or m.given or None
                before = [step[1:] for step in order["history"] if step[1] == side][-1:]
                step = (m.header.stamp, side, STATUS[m.status], m.reason or None)
                # Each file of a record repeats the present status, whose time is then estimated anew.
                if before != [step[1:]]:
                    order["history"].append(step)
        for order in orders.values():
            order["history"].sort(key=lambda step: step[0])
        return sorted(orders.values(), key=lambda order: (order["given"] or order["history"][0][0], order["slot"]))

    def link(self, side="operator"):
        """The link over time: rates in bit/s of the last minute, loss 0 to 1, times in s; NaN is unknown."""
        rows = [(m.header.stamp, *(getattr(m, name) for name in LINK)) for _, m in self._messages(side, "link")]
        return np.array(rows, [(name, "f8") for name in ("time", *LINK)])

    def track(self, side="operator"):
        """Poses: m east, north and up, degrees from north, sigma in m; of the vehicle's record in its map frame."""
        rows = []
        for _, m in self._messages(side, "pose"):
            rows.append((m.header.stamp, *_place(m.pose.pose), m.pose.covariance[0] ** 0.5))
        return np.array(rows, [(name, "f8") for name in TRACK])

    def frames(self, side="operator"):
        """The frames of all vehicles: time, vehicle, direction, number, bits on air, bits of each kind of content (a map, a status),
        reason of a drop and bytes."""
        found = self._side(side).messages("/scenecast/frames")
        return [{"time": m.header.stamp, "vehicle": m.vehicle, "direction": DIRECTION[m.direction],
                 "number": m.number, "bits": m.bits, "contents": dict(zip(m.contents, m.content_bits.tolist())),
                 "reason": m.reason or None, "data": m.data.tobytes()} for _, m in found]

    def events(self, side="operator"):
        """The entries of the page's log, or the vehicle's events: time, vehicle, level, source and text."""
        topic = "/scenecast/events" if side == "operator" else f"/scenecast/{self.name}/events"
        return [{"time": m.header.stamp, "vehicle": m.vehicle, "level": LEVEL.get(m.level, m.level), "source": m.source,
                 "text": m.text} for _, m in self._side(side).messages(topic)]
