#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the image of surface.usda, 8 x 4 pixels of Radiance RGBE without run lengths. Usage: make_image.py FILE.hdr"""
import pathlib
import sys

WIDTH, HEIGHT = 8, 4


def image():
    pixels = bytes(v for y in range(HEIGHT) for x in range(WIDTH) for v in (32 + 24 * x, 64 + 40 * y, 160, 128))
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode() + pixels


if __name__ == "__main__":
    pathlib.Path(sys.argv[1]).write_bytes(image())
