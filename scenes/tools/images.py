# SPDX-License-Identifier: Apache-2.0
"""Reads and writes images with nothing but the standard library: PNG (8 bit) and Radiance .hdr."""
import math
import struct
import zlib


def write_png(path, width, height, pixels):
    """pixels: bytes, [height][width][3], row 0 = top, display-encoded."""
    rows = b"".join(b"\0" + pixels[y * width * 3:(y + 1) * width * 3] for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def read_png(path):
    """Returns (width, height, pixels) of an 8- or 16-bit gray, RGB or RGBA PNG without interlace; 3 bytes per pixel."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path} is not a PNG")
    position, packed = 8, []
    width = height = depth = channels = 0
    while position < len(data):
        length, kind = struct.unpack(">I4s", data[position:position + 8])
        body = data[position + 8:position + 8 + length]
        position += 12 + length
        if kind == b"IHDR":
            width, height, depth, color, _, _, interlace = struct.unpack(">IIBBBBB", body)
            if color not in (0, 2, 4, 6) or depth not in (8, 16) or interlace:
                raise ValueError(f"{path}: this kind of PNG is not read here")
            channels = {0: 1, 2: 3, 4: 2, 6: 4}[color]
        elif kind == b"IDAT":
            packed.append(body)
    rows = unfilter(zlib.decompress(b"".join(packed)), height, width * channels * depth // 8, channels * depth // 8)
    step = depth // 8
    planes = [rows[c * step::channels * step] for c in range(channels)]
    red, green, blue = planes[:3] if channels >= 3 else (planes[0],) * 3
    out = bytearray(width * height * 3)
    out[0::3], out[1::3], out[2::3] = red, green, blue
    return width, height, bytes(out)


def unfilter(raw, height, stride, step):
    """Undoes the row filters of PNG (specification, section 9)."""
    out = bytearray()
    above = bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + stride])
        if kind == 1:
            for i in range(step, stride):
                row[i] = (row[i] + row[i - step]) & 255
        elif kind == 2:
            row = bytearray((a + b) & 255 for a, b in zip(row, above))
        elif kind == 3:
            for i in range(stride):
                left = row[i - step] if i >= step else 0
                row[i] = (row[i] + (left + above[i]) // 2) & 255
        elif kind == 4:
            for i in range(min(step, stride)):
                row[i] = (row[i] + above[i]) & 255
            for i in range(step, stride):
                a, b, c = row[i - step], above[i], above[i - step]
                pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - c - c)
                row[i] = (row[i] + (a if pa <= pb and pa <= pc else b if pb <= pc else c)) & 255
        out += row
        above = row
    return bytes(out)


def write_hdr(path, width, height, pixels):
    """Radiance RGBE, flat. pixels: rows of (r, g, b) floats, row 0 = top, scene-linear."""
    out = bytearray(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode())
    for row in pixels:
        for r, g, b in row:
            largest = max(r, g, b)
            if largest < 1e-32:
                out += b"\0\0\0\0"
                continue
            mantissa, exponent = math.frexp(largest)
            scale = mantissa * 256.0 / largest
            out += bytes((int(r * scale), int(g * scale), int(b * scale), exponent + 128))
    with open(path, "wb") as file:
        file.write(out)


def encode_srgb(v):
    """Scene-linear [0, 1] to a display byte (IEC 61966-2-1)."""
    v = min(max(v, 0.0), 1.0)
    return int(255.0 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055) + 0.5)
