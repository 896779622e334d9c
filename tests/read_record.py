"""Reads a record with rosbags, which nobody here wrote, and rebuilds the map from its changes.

usage: read_record.py FOLDER

Every message must decode, and every version of the map must have the cells and the fingerprint that the record states for it. Prints
JSON: messages by topic, versions of the map, cells and fingerprint of the last one, camera frames that changed cells, and what the
frames of the link carried.
"""

import json
import sys
from pathlib import Path

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MASK = (1 << 64) - 1


def term(cell, label):
    """A labelled cell in the fingerprint of protocol/WIRE.md, section 7."""
    x, y = cell
    place = ((x & 0xFFFFFFFF) << 32 | (y & 0xFFFFFFFF)) * 0x9E3779B97F4A7C15 & MASK
    z = place ^ label * 0xD6E8FEB86659FD93 & MASK
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 & MASK
    z = (z ^ z >> 27) * 0x94D049BB133111EB & MASK
    return z ^ z >> 31


def digest(cells):
    z = 0
    for cell, label in cells.items():
        z ^= term(cell, label)
    return (z ^ z >> 16 ^ z >> 32 ^ z >> 48) & 0xFFFF


def change(cells, message):
    if message.whole:
        cells.clear()
    for x, y, value in zip(message.x, message.y, message.value):
        if value:
            cells[int(x), int(y)] = int(value)
        else:
            cells.pop((int(x), int(y)), None)


def evidence(message):
    """Camera frames that changed cells. Each change must come from one, at most some seconds before, that saw words in the cell."""
    seconds = lambda time: time.sec + time.nanosec / 1e9
    if not message.frames or message.whole:
        return 0
    for index, words, confidence, value in zip(message.frame, message.words, message.confidence, message.value):
        assert not value or words > 0 and 0 <= confidence <= 1, (words, confidence)
        age = seconds(message.header.stamp) - seconds(message.frames[index].taken)
        assert 0 <= age < 20, age
    return len(message.frames)


def main(folder):
    store = get_typestore(Stores.EMPTY)
    frames, carried = 0, set()
    counts, cells, versions, stated = {}, {}, 0, None
    with Reader(Path(folder)) as reader:
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, _, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            if connection.topic.endswith("/map_cells") and not message.layer:
                change(cells, message)
                frames += evidence(message)
            if connection.topic == "/scenecast/frames":
                carried.update(message.contents)
                assert sum(message.content_bits) <= message.bits, message
            if connection.topic.endswith("/map_version"):
                if stated is not None:
                    assert (stated.cells, stated.digest) == (len(cells), digest(cells)), f"version {stated.version}"
                    versions += 1
                stated = message
        assert sum(counts.values()) == reader.message_count, (counts, reader.message_count)
    assert stated is not None and (stated.cells, stated.digest) == (len(cells), digest(cells)), "the last version"
    print(json.dumps({"topics": counts, "versions": versions + 1, "cells": len(cells), "digest": int(stated.digest), "frames": frames,
                      "carried": sorted(carried)}))


main(sys.argv[1])
