#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Recombines one render in several ways and puts the images side by side.

Usage: contact_sheet.py VELATURA_COMP LAYERS.exr OUTPUT_FOLDER LIGHT…

Every cell is one `velatura-comp mix`: no pixel is rendered again. LIGHT are the groups to show alone.
"""
import os
import pathlib
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor

from images import read_png, write_png

# 5 × 7 dots per letter; five columns from the left, lowest bit on top
FONT = {
    " ": "0000000000", "+": "08083e0808", ",": "0050300000", "-": "0808080808", ".": "0060600000", ":": "0036360000",
    "0": "3e5149453e", "1": "00427f4000", "2": "4261514946", "3": "2141454b31", "4": "1814127f10", "5": "2745454539",
    "6": "3c4a494930", "7": "0171090503", "8": "3649494936", "9": "064949291e", "a": "2054545478", "b": "7f48444438",
    "c": "3844444420", "d": "384444487f", "e": "3854545418", "f": "087e090102", "g": "0c5252523e", "h": "7f08040478",
    "i": "00447d4000", "j": "2040443d00", "k": "7f10284400", "l": "00417f4000", "m": "7c04180478", "n": "7c08040478",
    "o": "3844444438", "p": "7c14141408", "q": "081414187c", "r": "7c08040408", "s": "4854545420", "t": "043f444020",
    "u": "3c4040407c", "v": "1c2040201c", "w": "3c4030403c", "x": "4428102844", "y": "0c5050503c", "z": "4464544c44",
}
COLUMNS, CAPTION, GAP, DOT = 3, 24, 8, 2
PAPER, INK = b"\x16\x16\x18", b"\xd8\xd4\xcc"


def cells(lights):
    """(file name, caption, arguments of `velatura-comp mix`)"""
    yield "beauty", "beauty", []
    yield "direct", "direct light", ["--solo", "direct"]
    yield "indirect", "indirect light", ["--solo", "indirect"]
    for light in lights:
        yield f"light_{light}", f"only {light}", ["--solo", light]
    yield "indirect_up", "indirect +1.5 stops", ["--gain", "indirect=+1.5st"]
    yield "shadows_lifted", f"shadows of {lights[0]} lifted", ["--shadow", f"{lights[0]}=0.7"]


def halved(path):
    """An image at half its size: (width, rows of bytes)."""
    width, height, pixels = read_png(path)
    rows = []
    for y in range(0, height - 1, 2):
        a, b = pixels[y * width * 3:(y + 1) * width * 3], pixels[(y + 1) * width * 3:(y + 2) * width * 3]
        row = bytearray(width // 2 * 3)
        for c in range(3):
            row[c::3] = bytes((p + q + r + s + 2) >> 2 for p, q, r, s in zip(a[c::6], a[c + 3::6], b[c::6], b[c + 3::6]))
        rows.append(bytes(row))
    return width // 2, rows


def caption_rows(text, width):
    rows = [bytearray(PAPER * width) for _ in range(CAPTION)]
    for k, letter in enumerate(text.lower()):
        columns = bytes.fromhex(FONT.get(letter, FONT["-"]))
        for i in range(5 * DOT):
            for j in range(7 * DOT):
                x = 4 + k * 6 * DOT + i
                if columns[i // DOT] >> (j // DOT) & 1 and x < width:
                    rows[5 + j][3 * x:3 * x + 3] = INK
    return rows


def sheet(renders, path, columns=COLUMNS):
    """images: [(caption, file)], all of one size."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        small = list(pool.map(halved, [file for _, file in renders]))
    cell = small[0][0]
    total = GAP + columns * (cell + GAP)
    lines = [PAPER * total] * GAP
    for first in range(0, len(renders), columns):
        group = list(zip(renders, small))[first:first + columns]
        blocks = [rows + [bytes(r) for r in caption_rows(caption, cell)] for (caption, _), (_, rows) in group]
        for line in zip(*blocks):
            text = PAPER * GAP + b"".join(part + PAPER * GAP for part in line)
            lines.append(text + PAPER * (total - len(text) // 3))
    write_png(path, total, len(lines), b"".join(lines))


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__.strip())
    comp, layers, folder, lights = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]), sys.argv[4:]
    renders = []
    for name, caption, arguments in cells(lights):
        file = folder / f"{name}.png"
        command = [comp, "mix", layers, "-o", str(file), *arguments]
        print("  " + " ".join(command), flush=True)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        renders.append((caption, file))
    sheet(renders, folder / "contact_sheet.png")


if __name__ == "__main__":
    main()
