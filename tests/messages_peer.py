"""Compares scenecast's messages with those of rosbags, and writes samples that rosbags encoded.

usage: messages_peer.py DEFINITIONS SAMPLES

DEFINITIONS is a JSON list of {name, hash, msg, schema}. Standard messages are compared with the typestore of ROS 2 Jazzy.
SAMPLES receives one line a sample: the name of the message, a space, and its bytes in hexadecimal digits.
"""

import json
import random
import sys

import numpy
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

SAMPLES = 20
# rosbags takes a byte as signed.
RANGES = {"byte": (0, 127), "uint8": (0, 255), "int8": (-128, 127), "uint16": (0, 2**16 - 1), "int16": (-(2**15), 2**15 - 1),
          "uint32": (0, 2**32 - 1), "int32": (-(2**31), 2**31 - 1), "uint64": (0, 2**64 - 1), "int64": (-(2**63), 2**63 - 1)}


def primitive(kind):
    if kind == "string":
        return "".join(random.choice("abc é/_") for _ in range(random.randrange(9)))
    if kind == "bool":
        return random.random() < 0.5
    if kind in RANGES:
        return random.randint(*RANGES[kind])
    value = random.choice([random.uniform(-1e6, 1e6), 0.0, float("inf"), float("nan")])
    return float(numpy.float32(value)) if kind == "float32" else value


def elements(store, kind, count):
    if kind[0] == Nodetype.BASE and kind[1][0] not in ("string",):
        base = {"byte": "uint8"}.get(kind[1][0], kind[1][0])
        return numpy.array([primitive(kind[1][0]) for _ in range(count)], dtype=base)
    return [value(store, kind) for _ in range(count)]


def value(store, kind):
    match kind:
        case (Nodetype.BASE, (name, _)):
            return primitive(name)
        case (Nodetype.NAME, name):
            return sample(store, name)
        case (Nodetype.ARRAY, (element, count)):
            return elements(store, element, count)
        case (Nodetype.SEQUENCE, (element, _)):
            return elements(store, element, random.choice([0, 1, 2, 5]))
    raise TypeError(kind)


def sample(store, name):
    return store.types[name](**{field: value(store, kind) for field, kind in store.fielddefs[name][1]})


def main():
    random.seed(18)
    with open(sys.argv[1]) as file:
        messages = json.load(file)
    store = get_typestore(Stores.ROS2_JAZZY)
    standard = dict(store.fielddefs)
    ours = {}
    for message in messages:
        ours |= get_types_from_msg(message["msg"], message["name"])
    store.register({name: fields for name, fields in ours.items() if name not in standard})
    foreign = {name.split("/")[0] for name in ours if name not in standard}
    assert foreign == {"grid_map_msgs", "scenecast_msgs"}, foreign
    with open(sys.argv[2], "w") as samples:
        for message in messages:
            name = message["name"]
            if name in standard:
                assert ours[name] == standard[name], (name, ours[name], standard[name])
            assert store.hash_rihs01(name) == message["hash"], (name, store.hash_rihs01(name))
            schema = get_types_from_msg(message["schema"], name)
            assert schema == {part: ours[part] for part in schema}, name
            # A schema that lacks a part fails here.
            alone = get_typestore(Stores.EMPTY)
            alone.register(schema)
            assert alone.hash_rihs01(name) == message["hash"], name
            for _ in range(SAMPLES):
                samples.write(f"{name} {bytes(store.serialize_cdr(sample(store, name), name)).hex()}\n")
    print(f"{len(messages)} messages")


main()
