# SPDX-License-Identifier: Apache-2.0
"""Tileable value noise, row by row."""
import random


class Noise:
    """One octave of value noise on a lattice of cells_x × cells_y, periodic over the unit square."""

    def __init__(self, cells_x, cells_y, seed):
        rng = random.Random(seed)
        self.cells_x, self.cells_y = cells_x, cells_y
        self.lattice = [[rng.random() for _ in range(cells_x)] for _ in range(cells_y)]

    def at(self, s, t):
        x, y = (s % 1.0) * self.cells_x, (t % 1.0) * self.cells_y
        i, j = int(x), int(y)
        u, v = x - i, y - j
        u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
        i, j = i % self.cells_x, j % self.cells_y
        row, next_row = self.lattice[j], self.lattice[(j + 1) % self.cells_y]
        k = (i + 1) % self.cells_x
        a = row[i] + (row[k] - row[i]) * u
        b = next_row[i] + (next_row[k] - next_row[i]) * u
        return a + (b - a) * v


class Fractal:
    """Sum of octaves in [0, 1]; each has twice the frequency and half the weight."""

    def __init__(self, cells_x, cells_y, octaves, seed):
        self.octaves = [(0.5 ** k, Noise(cells_x << k, cells_y << k, seed + k)) for k in range(octaves)]
        self.total = sum(weight for weight, _ in self.octaves)

    def at(self, s, t):
        return sum(weight * noise.at(s, t) for weight, noise in self.octaves) / self.total
