"""Reads the messages of a record, which is a folder of MCAP files."""

import re
import struct
import warnings
import zlib
from pathlib import Path

import zstandard

from .cdr import Decoder

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 3, 4, 5, 6, 15
LARGEST = 512 << 20
UNKNOWN = (1 << 64) - 1


class DamagedRecord(UserWarning):
    """A file of a record ends early or is damaged; what is before and after the damage is read."""


def _text(data, at):
    size, = struct.unpack_from("<I", data, at)
    return data[at + 4:at + 4 + size], at + 4 + size


def _records(data):
    at = 0
    while at < len(data):
        kind, size = struct.unpack_from("<BQ", data, at)
        if at + 9 + size > len(data):
            raise ValueError("a record is cut")
        yield kind, at + 9, size
        at += 9 + size


def _unpack(chunk):
    """The records in a chunk, after a check of its CRC-32."""
    size, crc = struct.unpack_from("<QI", chunk, 16)
    compression, at = _text(chunk, 28)
    data = chunk[at + 8:]
    if size > LARGEST:
        raise ValueError(f"a chunk has {size} bytes")
    if compression not in (b"", b"zstd"):
        raise ValueError(f"compression {compression!r}")
    if compression:
        data = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    if len(data) != size or crc and zlib.crc32(data) != crc:
        raise ValueError("a chunk is not what was written")
    return data


class Record:
    """A record: the messages of each topic in the order in which they were written."""

    def __init__(self, path):
        """Finds the messages of a folder of files `*.mcap`, of one file, or of a list of folders, as an end makes that was started again;
        they are decoded on demand."""
        paths = [Path(part) for part in (path if isinstance(path, (list, tuple)) else [path])]
        self.path = paths[0]
        self.index = {}  # by topic: (time in s, block, first byte, size) of each message
        self._blocks = []  # file, first byte and size of each chunk, and whether it is one
        self._decoders, self._channels, self._schemas, self._held = {}, {}, {}, (None, b"")
        files = []
        for part in paths:
            found = [part] if part.is_file() else list(part.glob("*.mcap"))
            if not found:
                raise FileNotFoundError(f"{part}: there is no file *.mcap")
            # The number at the end of a name counts the files.
            files += sorted(found, key=lambda file: [int(n) for n in re.findall(r"\d+", file.stem)[-1:]])
        for file in files:
            self._channels, self._schemas = {}, {}
            try:
                with file.open("rb") as opened:
                    damage = self._read(file, opened)
                if damage:
                    warnings.warn(f"{file}: {len(damage)} chunks are left out: {damage[0]}", DamagedRecord, stacklevel=3)
            except (ValueError, KeyError, struct.error, zstandard.ZstdError) as error:
                warnings.warn(f"{file}: read as far as it is whole: {error}", DamagedRecord, stacklevel=3)
        if len(paths) > 1:
            for entries in self.index.values():
                entries.sort(key=lambda entry: entry[0])
        times = [time for entries in self.index.values() for time, *_ in entries]
        self.begin, self.end = (min(times), max(times)) if times else (float("nan"), float("nan"))

    def _read(self, file, opened):
        """Finds the messages of a file, and returns what is wrong with the chunks that are left out."""
        damage = []
        if opened.read(8) != MAGIC:
            raise ValueError("it is no MCAP file")
        while True:
            at, head = opened.tell(), opened.read(9)
            if len(head) < 9:
                raise ValueError("its end is missing")
            kind, size = struct.unpack("<BQ", head)
            if kind == DATA_END:
                return damage
            if kind == CHUNK and size == UNKNOWN:
                raise ValueError("its last part is not finished: the mission runs, or the recorder was cut off")
            if not 0 < kind < 128 or size > LARGEST:
                raise ValueError(f"damage at byte {at}")
            body = opened.read(size)
            if len(body) < size:
                raise ValueError("its last part is cut")
            if kind in (SCHEMA, CHANNEL, MESSAGE, CHUNK):
                self._blocks.append((file, at, 9 + size, kind == CHUNK))
                try:
                    self._find(_unpack(body) if kind == CHUNK else head + body)
                except (ValueError, KeyError, struct.error, zstandard.ZstdError) as error:
                    damage.append(error)

    def _find(self, data):
        found = []
        for kind, at, size in _records(data):
            if kind == SCHEMA:
                name, after = _text(data, at + 2)
                _, after = _text(data, after)
                self._schemas[data[at:at + 2]] = name.decode(), _text(data, after)[0].decode()
            elif kind == CHANNEL:
                topic = _text(data, at + 4)[0].decode()
                self._channels[data[at:at + 2]] = topic
                name, text = self._schemas[data[at + 2:at + 4]]
                self._decoders[topic] = Decoder(text, name)
            elif kind == MESSAGE:
                nanos, = struct.unpack_from("<Q", data, at + 6)
                entry = nanos / 1e9, len(self._blocks) - 1, at + 22, size - 22
                # The chunk that described the channel may be one that is left out.
                found.append((self._channels.get(data[at:at + 2]), entry))
        for topic, entry in (pair for pair in found if pair[0]):
            self.index.setdefault(topic, []).append(entry)

    def _block(self, number):
        if self._held[0] != number:
            file, at, size, is_chunk = self._blocks[number]
            with file.open("rb") as opened:
                opened.seek(at)
                data = opened.read(size)
            self._held = number, _unpack(data[9:]) if is_chunk else data
        return self._held[1]

    def messages(self, topic, until=None):
        """The pairs (time in s of UTC since 1970, message) of a topic, up to a time."""
        for time, block, at, size in self.index.get(topic, ()):
            if until is None or time <= until:
                yield time, self._decoders[topic].decode(self._block(block)[at:at + size])

    def last(self, topic, until=None):
        """The last pair (time in s, message) of a topic up to a time, or None."""
        for time, block, at, size in reversed(self.index.get(topic, ())):
            if until is None or time <= until:
                return time, self._decoders[topic].decode(self._block(block)[at:at + size])
        return None
