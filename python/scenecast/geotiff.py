"""Writes GeoTIFF files (TIFF 6.0, OGC GeoTIFF 1.1)."""

import struct
import zlib

TYPES = {"s": (2, 1), "H": (3, 2), "I": (4, 4), "d": (12, 8)}
# Colours of the labels 1 to 16 on the operator's page, which repeat here.
PALETTE = (0xe69f00, 0x56b4e9, 0x009e73, 0xf0e442, 0x0072b2, 0xd55e00, 0xcc79a7, 0x962d00,
           0xb4c3a5, 0xa569ff, 0x694b69, 0x5a00e1, 0x96d2ff, 0x786978, 0x96ffa5, 0xb44b3c)


def colour_map():
    """All reds, greens and blues in 16 bits; 0 is black."""
    colours = [0] + [PALETTE[i % len(PALETTE)] for i in range(255)]
    return [(colour >> shift & 255) * 257 for shift in (16, 8, 0) for colour in colours]


def geo_keys(origin):
    """The directory of keys and its doubles: transverse Mercator about an origin in WGS 84, or metres alone."""
    if origin is None:
        return [], []
    shorts = [(1024, 1), (1025, 1), (2048, 4326), (2054, 9102), (3072, 32767), (3074, 32767), (3075, 1), (3076, 9001)]
    doubles = [(3080, origin[1]), (3081, origin[0]), (3082, 0.0), (3083, 0.0), (3092, 1.0)]
    keys = [1, 1, 0, len(shorts) + len(doubles)]
    for key, value in shorts:
        keys += [key, 0, 1, value]
    for at, (key, _) in enumerate(doubles):
        keys += [key, 34736, 1, at]
    return keys, [value for _, value in doubles]


def geotiff(pixels, west, north, cell_m, origin=None):
    """The bytes of a file with an array of bytes, row 0 northernmost, in one strip; 0 is no data."""
    data = zlib.compress(pixels.tobytes())
    keys, doubles = geo_keys(origin)
    height, width = pixels.shape
    tags = [(256, "I", [width]), (257, "I", [height]), (258, "H", [8]), (259, "H", [8]), (262, "H", [3]), (273, "I", [8]),
            (277, "H", [1]), (278, "I", [height]), (279, "I", [len(data)]), (320, "H", colour_map()),
            (33550, "d", [cell_m, cell_m, 0.0]), (33922, "d", [0.0, 0.0, 0.0, west, north, 0.0]),
            (34735, "H", keys), (34736, "d", doubles), (42113, "s", [b"0\0"])]
    tags = [tag for tag in tags if tag[2]]
    body = data + b"\0" * (len(data) % 2)
    directory = 8 + len(body)
    after, entries, long = directory + 2 + 12 * len(tags) + 4, b"", b""
    for tag, kind, values in tags:
        number, size = TYPES[kind]
        packed = values[0] if kind == "s" else struct.pack(f"<{len(values)}{kind}", *values)
        entries += struct.pack("<HHI", tag, number, len(packed) // size)
        if len(packed) > 4:
            entries += struct.pack("<I", after + len(long))
            long += packed + b"\0" * (len(packed) % 2)
        else:
            entries += packed.ljust(4, b"\0")
    return struct.pack("<2sHI", b"II", 42, directory) + body + struct.pack("<H", len(tags)) + entries + b"\0" * 4 + long
