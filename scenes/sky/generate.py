#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The sky of scenes/sky as a Radiance image: Preetham's clear sky with a sun.

Usage: generate.py FOLDER

The sun's disc is 1.2 degrees wide, twice the real one, so that the map can resolve it; its irradiance on a surface that
faces it is SUN_TO_SKY times the irradiance of the sky on the ground. Radiance is scaled to 1 at the zenith.
"""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from tools.images import write_hdr
from tools.sky import Sky, lat_long_direction

WIDTH, HEIGHT = 1024, 512
ELEVATION_DEG, AZIMUTH_DEG, TURBIDITY = 27, -66, 2.6
SUN_TO_SKY, SUN_COLOR, SUN_RADIUS_DEG = 5.0, (1.12, 0.98, 0.78), 0.6
GROUND = (0.10, 0.095, 0.085)


def main(folder):
    sky = Sky(ELEVATION_DEG, AZIMUTH_DEG, TURBIDITY)
    rows, irradiance, sun_pixels, sun_solid_angle = [], 0.0, [], 0.0
    for y in range(HEIGHT):
        pixel_solid_angle = (2 * math.pi / WIDTH) * (math.cos(math.pi * y / HEIGHT) - math.cos(math.pi * (y + 1) / HEIGHT))
        row = []
        for x in range(WIDTH):
            d = lat_long_direction(x, y, WIDTH, HEIGHT)
            if d[1] <= 0:
                row.append(GROUND)
                continue
            rgb = sky.radiance(d)
            irradiance += (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) * d[1] * pixel_solid_angle
            if sum(a * b for a, b in zip(d, sky.sun)) > math.cos(math.radians(SUN_RADIUS_DEG)):
                sun_pixels.append((x, y))
                sun_solid_angle += pixel_solid_angle
            row.append(rgb)
        rows.append(row)
    sun = [SUN_TO_SKY * irradiance * c / sun_solid_angle for c in SUN_COLOR]
    for x, y in sun_pixels:
        rows[y][x] = tuple(a + b for a, b in zip(rows[y][x], sun))
    folder.mkdir(exist_ok=True)
    write_hdr(folder / "sky.hdr", WIDTH, HEIGHT, rows)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "generated"))
