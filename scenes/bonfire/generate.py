#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes bonfire.vdb: grids `density` and `heat` of a fire one unit wide and its smoke.

Usage: generate.py FOLDER      needs numpy and pyopenvdb (Debian: python3-openvdb)
"""
import pathlib
import sys

try:
    import numpy
    import pyopenvdb
except ImportError as missing:
    print(f"bonfire is left out: {missing}", file=sys.stderr)
    sys.exit(77)

SHAPE = (72, 150, 72)  # voxels; y is up
VOXEL = 3.0 / 150


def value_noise(p, seed):
    """Noise in [-1, 1] at points p [..., 3], smooth over one unit."""
    cell = numpy.floor(p).astype(numpy.int64)
    t = p - cell
    t = t * t * (3 - 2 * t)
    out = numpy.zeros(p.shape[:-1])
    for corner in range(8):
        at = [(corner >> a) & 1 for a in range(3)]
        weight = numpy.ones(p.shape[:-1])
        key = numpy.full(p.shape[:-1], seed, dtype=numpy.uint64)
        for a in range(3):
            weight *= t[..., a] if at[a] else 1 - t[..., a]
            key = (key ^ (cell[..., a] + at[a]).astype(numpy.uint64)) * numpy.uint64(0x9E3779B97F4A7C15)
            key ^= key >> numpy.uint64(29)
        out += weight * ((key >> numpy.uint64(11)).astype(numpy.float64) / 2.0**53 * 2 - 1)
    return out


def turbulence(p, seed, octaves=5):
    return sum(value_noise(p * 2.0**i, seed + i) / 2.0**i for i in range(octaves))


def fields():
    index = numpy.stack(numpy.meshgrid(*[numpy.arange(n) for n in SHAPE], indexing="ij"), axis=-1)
    p = (index + 0.5 - numpy.array([SHAPE[0] / 2, 0, SHAPE[2] / 2])) * VOXEL
    height = p[..., 1]
    # What rises is torn aside, the higher the more
    shift = numpy.stack([turbulence(p * [1.6, 1.1, 1.6] + 7 * k, 100 * k) for k in range(1, 4)], axis=-1)
    q = p + shift * (0.05 + 0.11 * height[..., None]) * [1, 0.5, 1]
    radius = numpy.hypot(q[..., 0], q[..., 2])
    tongues = 0.5 + 0.5 * turbulence(q * [5, 2.2, 5] - [0, 2, 0], 900)
    flame = numpy.clip(1 - radius / (0.46 - 0.3 * q[..., 1]), 0, 1) * numpy.clip(1.45 - q[..., 1], 0, 1)
    heat = numpy.clip(flame * (0.35 + tongues) - 0.12, 0, None) * numpy.clip(height * 12, 0, 1)
    smoke = numpy.clip(1 - radius / (0.2 + 0.2 * height), 0, 1) * numpy.clip((height - 0.7) * 1.6, 0, 1)
    density = numpy.clip(smoke * (0.2 + tongues) - 0.08, 0, None) * numpy.clip((3.0 - height) * 1.5, 0, 1)
    return {"density": density, "heat": heat}


def main(folder):
    grids = []
    for name, values in fields().items():
        values[values < 0.004] = 0
        grid = pyopenvdb.FloatGrid()
        grid.copyFromArray(values.astype(numpy.float32))
        grid.name = name
        grid.gridClass = pyopenvdb.GridClass.FOG_VOLUME
        transform = pyopenvdb.createLinearTransform(VOXEL)
        transform.translate((-SHAPE[0] / 2 * VOXEL, 0, -SHAPE[2] / 2 * VOXEL))
        grid.transform = transform
        grid.saveFloatAsHalf = True
        grids.append(grid)
    pyopenvdb.write(str(folder / "bonfire.vdb"), grids=grids)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
