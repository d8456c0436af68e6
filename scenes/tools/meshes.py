# SPDX-License-Identifier: Apache-2.0
"""Polygon meshes by formula, and their text as USD prims. Y is up; counter-clockwise faces look outward."""
import math


class Mesh:
    """points, normals: [(x, y, z)] per vertex; st: [(s, t)] per vertex or empty; faces: [[vertex, …]]."""

    def __init__(self, points=None, normals=None, st=None, faces=None):
        self.points, self.normals = points or [], normals or []
        self.st, self.faces = st or [], faces or []

    def add(self, other):
        first = len(self.points)
        self.points += other.points
        self.normals += other.normals
        self.st += other.st
        self.faces += [[first + v for v in face] for face in other.faces]
        return self

    def moved(self, by):
        self.points = [tuple(p[k] + by[k] for k in range(3)) for p in self.points]
        return self

    def warped(self, function):
        """Moves every point by a function and takes the normals from the faces anew."""
        self.points = [function(p) for p in self.points]
        self.normals = smooth_normals(self.points, self.faces)
        return self


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(v):
    length = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) or 1.0
    return (v[0] / length, v[1] / length, v[2] / length)


def smooth_normals(points, faces):
    """Area-weighted; vertices at one place share theirs, so that seams do not show."""
    sums = {}
    keys = [tuple(round(c, 4) for c in p) for p in points]
    for face in faces:
        a, b, c = points[face[0]], points[face[1]], points[face[2]]
        n = cross(sub(b, a), sub(c, a))
        if len(face) == 4:
            m = cross(sub(c, a), sub(points[face[3]], a))
            n = (n[0] + m[0], n[1] + m[1], n[2] + m[2])
        for v in face:
            s = sums.setdefault(keys[v], [0.0, 0.0, 0.0])
            for k in range(3):
                s[k] += n[k]
    return [unit(sums.get(key, (0.0, 1.0, 0.0))) for key in keys]


def spline(knots, steps):
    """Catmull-Rom through (r, y) knots, steps points per span."""
    out = []
    for i in range(len(knots) - 1):
        p0, p1 = knots[max(i - 1, 0)], knots[i]
        p2, p3 = knots[i + 1], knots[min(i + 2, len(knots) - 1)]
        for s in range(steps):
            t = s / steps
            out.append(tuple(0.5 * (2 * p1[k] + (p2[k] - p0[k]) * t + (2 * p0[k] - 5 * p1[k] + 4 * p2[k] - p3[k]) * t * t
                                    + (3 * p1[k] - p0[k] - 3 * p2[k] + p3[k]) * t ** 3) for k in range(2)))
    out.append(knots[-1])
    return [(max(r, 0.0), y) for r, y in out]


def lathe(parts, columns=96):
    """Turns profiles [(r, y), …] about y. Going up means looking outward. Parts meet in sharp edges."""
    mesh = Mesh()
    for profile in parts:
        strip = Mesh()
        rows = len(profile)
        length = [0.0]
        for a, b in zip(profile, profile[1:]):
            length.append(length[-1] + math.dist(a, b))
        for i, (r, y) in enumerate(profile):
            a, b = profile[max(i - 1, 0)], profile[min(i + 1, rows - 1)]
            dr, dy = b[0] - a[0], b[1] - a[1]
            # The normal of a profile that starts or ends on the axis is the axis
            nr, ny = (0.0, -dr) if r == 0.0 else (dy, -dr)
            for j in range(columns + 1):
                angle = 2 * math.pi * j / columns
                c, s = math.cos(angle), math.sin(angle)
                strip.points.append((r * c, y, r * s))
                strip.normals.append(unit((nr * c, ny, nr * s)))
                strip.st.append((j / columns, length[i] / (length[-1] or 1.0)))
        for i in range(rows - 1):
            for j in range(columns):
                a, b = i * (columns + 1) + j, (i + 1) * (columns + 1) + j
                if profile[i][0] == 0.0 and profile[i + 1][0] == 0.0:
                    continue
                if profile[i][0] == 0.0:
                    strip.faces.append([a, b, b + 1])
                elif profile[i + 1][0] == 0.0:
                    strip.faces.append([a, b, a + 1])
                else:
                    strip.faces.append([a, b, b + 1, a + 1])
        mesh.add(strip)
    return mesh


def tube(path, radius, columns=10):
    """Sweeps circles along [(x, y, z), …]; radius is a function of the position 0…1 along the path."""
    mesh = Mesh()
    for i, p in enumerate(path):
        axis = unit(sub(path[min(i + 1, len(path) - 1)], path[max(i - 1, 0)]))
        side = unit(cross(axis, (0.31, 0.07, 0.95)))
        up = cross(side, axis)
        r = radius(i / (len(path) - 1))
        for j in range(columns + 1):
            c, s = math.cos(2 * math.pi * j / columns), math.sin(2 * math.pi * j / columns)
            n = tuple(side[k] * c + up[k] * s for k in range(3))
            mesh.points.append(tuple(p[k] + r * n[k] for k in range(3)))
            mesh.normals.append(n)
            mesh.st.append((j / columns, i / (len(path) - 1)))
    for i in range(len(path) - 1):
        for j in range(columns):
            a, b = i * (columns + 1) + j, (i + 1) * (columns + 1) + j
            mesh.faces.append([a, b, b + 1, a + 1])
    return mesh


def sheet(function, columns, rows):
    """function(u, v) → point, u and v in [0, 1]; looks along d/dv × d/du."""
    mesh = Mesh()
    for i in range(rows + 1):
        for j in range(columns + 1):
            mesh.points.append(function(j / columns, i / rows))
            mesh.st.append((j / columns, i / rows))
    for i in range(rows):
        for j in range(columns):
            a, b = i * (columns + 1) + j, (i + 1) * (columns + 1) + j
            mesh.faces.append([a, b, b + 1, a + 1])
    mesh.normals = smooth_normals(mesh.points, mesh.faces)
    return mesh


def rounded_box(size, bevel, steps=3):
    """Box about the origin with rounded edges; flat sides keep flat normals. st runs over x and z."""
    inner = [s / 2 - bevel for s in size]
    latitudes = []
    for half in (-1, 1):
        for k in range(steps + 1):
            a = math.pi / 2 * (k / steps if half > 0 else k / steps - 1)
            latitudes.append((half, a))
    longitudes = []
    for quarter in range(4):
        for k in range(steps + 1):
            a = math.pi / 2 * (quarter + k / steps)
            longitudes.append((1 if quarter in (0, 3) else -1, 1 if quarter < 2 else -1, a))
    mesh = Mesh()
    for sign_y, lat in latitudes:
        for sign_x, sign_z, lon in longitudes:
            n = (math.cos(lat) * math.cos(lon), math.sin(lat), math.cos(lat) * math.sin(lon))
            p = (sign_x * inner[0] + bevel * n[0], sign_y * inner[1] + bevel * n[1], sign_z * inner[2] + bevel * n[2])
            mesh.points.append(p)
            mesh.normals.append(n)
            mesh.st.append((0.5 + p[0] / size[0], 0.5 - p[2] / size[2]))
    n = len(longitudes)
    for i in range(len(latitudes) - 1):
        for j in range(n):
            a, b, c, d = i * n + j, (i + 1) * n + j, (i + 1) * n + (j + 1) % n, i * n + (j + 1) % n
            # Rows at the poles are four corners, not a circle: their steps have no area
            if math.dist(mesh.points[a], mesh.points[d]) < 1e-9:
                if math.dist(mesh.points[b], mesh.points[c]) > 1e-9:
                    mesh.faces.append([a, b, c])
            elif math.dist(mesh.points[b], mesh.points[c]) < 1e-9:
                mesh.faces.append([a, b, d])
            else:
                mesh.faces.append([a, b, c, d])
    last = (len(latitudes) - 1) * n
    corners = [k * (steps + 1) for k in range(4)]
    mesh.faces.append([last + k for k in reversed(corners)])
    mesh.faces.append(corners)
    return mesh


def number(x):
    return f"{x:.5g}" if abs(x) > 1e-6 else "0"


def usd_mesh(name, mesh, indent="", double_sided=False):
    """The text of a Mesh prim."""
    def tuples(rows):
        return ", ".join("(" + ", ".join(map(number, row)) + ")" for row in rows)

    low = [min(p[k] for p in mesh.points) for k in range(3)]
    high = [max(p[k] for p in mesh.points) for k in range(3)]
    lines = [f'def Mesh "{name}"', "{"]
    if double_sided:
        lines.append("    uniform bool doubleSided = 1")
    lines += [
        f"    float3[] extent = [{tuples([low, high])}]",
        f"    int[] faceVertexCounts = [{', '.join(str(len(f)) for f in mesh.faces)}]",
        f"    int[] faceVertexIndices = [{', '.join(str(v) for f in mesh.faces for v in f)}]",
        f"    point3f[] points = [{tuples(mesh.points)}]",
        f"    normal3f[] normals = [{tuples(mesh.normals)}] (",
        '        interpolation = "vertex"',
        "    )",
        f"    texCoord2f[] primvars:st = [{tuples(mesh.st)}] (",
        '        interpolation = "vertex"',
        "    )",
        '    uniform token subdivisionScheme = "none"',
        "}",
    ]
    return "\n".join(indent + line for line in lines) + "\n"
