# SPDX-License-Identifier: Apache-2.0
"""A second reader of EXR files, from the file format's description: scanlines, without or with ZIP compression.

Ref: "OpenEXR File Layout", openexr.com.
"""
import struct
import zlib

import numpy

TYPES = {0: numpy.dtype("<u4"), 1: numpy.dtype("<f2"), 2: numpy.dtype("<f4")}
ROWS = {0: 1, 2: 1, 3: 16}  # of a chunk: none, ZIPS, ZIP


def text_at(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def header_at(data, at):
    attributes = {}
    while data[at]:
        name, at = text_at(data, at)
        kind, at = text_at(data, at)
        size = struct.unpack_from("<i", data, at)[0]
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def channels_of(value):
    channels, at = [], 0
    while value[at]:
        name, at = text_at(value, at)
        channels.append((name, TYPES[struct.unpack_from("<i", value, at)[0]]))
        at += 16
    return channels


def unpacked(block, size):
    if len(block) == size:
        return block
    differences = numpy.frombuffer(zlib.decompress(block), numpy.uint8).astype(numpy.int64)
    differences[1:] -= 128
    halves = numpy.cumsum(differences).astype(numpy.uint8)
    middle = (size + 1) // 2
    out = numpy.empty(size, numpy.uint8)
    out[0::2], out[1::2] = halves[:middle], halves[middle:]
    return out.tobytes()


def read(path):
    """{full name of a channel: array [height, width]} of all parts."""
    data = open(path, "rb").read()
    magic, version = struct.unpack_from("<ii", data)
    assert magic == 20000630
    is_multipart = bool(version & 0x1000)
    headers, at = [], 8
    while not headers or (is_multipart and data[at]):
        header, at = header_at(data, at)
        headers.append(header)
    at += is_multipart
    parts, found = [], {}
    for header in headers:
        x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
        rows = ROWS[header["compression"][0]]
        chunks = -(-(y1 - y0 + 1) // rows)
        parts.append((channels_of(header["channels"]), x1 - x0 + 1, y0, y1, rows,
                      struct.unpack_from(f"<{chunks}Q", data, at)))
        at += 8 * chunks
    for channels, width, y0, y1, rows, offsets in parts:
        for name, kind in channels:
            found[name] = numpy.empty((y1 - y0 + 1, width), kind)
        for offset in offsets:
            y, size = struct.unpack_from("<ii", data, offset + 4 * is_multipart)
            begin = offset + 4 * is_multipart + 8
            count = min(rows, y1 - y + 1)
            row_bytes = width * sum(kind.itemsize for _, kind in channels)
            block, at = unpacked(data[begin:begin + size], count * row_bytes), 0
            for row in range(y - y0, y - y0 + count):
                for name, kind in channels:
                    found[name][row] = numpy.frombuffer(block, kind, width, at)
                    at += width * kind.itemsize
    return found
