"""Decodes messages in CDR by the text of their definition, which each record contains."""

import re
import struct
from types import SimpleNamespace

import numpy as np

SIZES = {"bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
         "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"}
TIME = "builtin_interfaces/Time"
FIELD = re.compile(r"([\w/]+)(<=\d+)?(\[(?:<=)?\d*\])?\s+(\w+)\s*(=?)")


def fields_of(text, kind):
    """The fields of each type of a ros2msg definition: name, type, and array, which is None, 0 or its fixed length."""
    types, package = {}, kind.split("/")[0]
    for number, part in enumerate(re.split(r"^=+\n", text, flags=re.M)):
        head, _, body = part.partition("\n") if number else ("", "", part)
        name = head.removeprefix("MSG:").strip().replace("/msg/", "/") if number else ""
        types[name] = []
        for line in body.splitlines():
            found = FIELD.match(line.split("#")[0].strip())
            if not found or found[5]:
                continue
            inner, array = found[1].replace("/msg/", "/"), found[3]
            if inner not in SIZES and inner not in ("string", "wstring") and "/" not in inner:
                inner = f"{(name or package).split('/')[0]}/{inner}"
            fixed = array is not None and array[1:-1].isdigit()
            types[name].append((found[4], inner, None if array is None else int(array[1:-1]) if fixed else 0))
    return types


class Decoder:
    """Decodes messages of one type."""

    def __init__(self, text, kind):
        self.types = fields_of(text, kind)

    def decode(self, data):
        """The message with its fields as attributes; times are seconds of UTC since 1970."""
        self.order, self.data, self.at = "<" if data[1] & 1 else ">", data[4:], 0
        return self._message("")

    def _message(self, name):
        return SimpleNamespace(**{field: self._value(kind, array) for field, kind, array in self.types[name]})

    def _value(self, kind, array):
        if array is None:
            return self._single(kind)
        count = array or self._single("uint32")
        if kind in SIZES:
            return self._numbers(kind, count)
        return [self._single(kind) for _ in range(count)]

    def _single(self, kind):
        if kind in SIZES:
            return self._numbers(kind, 1)[0].item()
        if kind == "string":
            size = self._single("uint32")
            return self._take(size)[:-1].decode("utf-8", "replace")
        message = self._message(kind)
        return message.sec + message.nanosec / 1e9 if kind == TIME else message

    def _numbers(self, kind, count):
        size = struct.calcsize("<" + SIZES[kind])
        self.at += -self.at % size if count else 0
        return np.frombuffer(self._take(size * count), np.dtype(self.order + SIZES[kind]))

    def _take(self, size):
        taken = self.data[self.at:self.at + size]
        if len(taken) < size:
            raise ValueError("a message is shorter than its definition says")
        self.at += size
        return taken
