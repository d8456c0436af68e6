#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Meshes, textures and the sky of the atelier. Lengths are centimetres; y is up; the table top is y = 0."""
import math
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from tools.images import encode_srgb, write_hdr, write_png
from tools.meshes import Mesh, lathe, rounded_box, sheet, spline, tube, usd_mesh
from tools.noise import Fractal, Noise
from tools.sky import Sky, lat_long_direction

out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "generated")


# ---- shapes -----------------------------------------------------------------------------------------------------

def vase():
    outside = spline([(0, 0), (5.2, 0), (5.6, 0.6), (8.6, 9), (9.2, 15), (7.0, 22), (3.9, 27), (3.4, 30), (4.6, 33.2), (5.0, 33.8)], 10)
    inside = spline([(5.0, 33.8), (4.7, 34.0), (4.2, 33.2), (3.0, 30), (3.4, 27), (6.2, 22), (8.2, 15), (7.6, 9), (4.8, 1.5), (0, 1.2)], 10)
    return lathe([outside, inside])


def wine_glass():
    """One closed surface: foot, stem, bowl outside, lip, bowl inside."""
    outside = spline([(0, 0), (3.4, 0), (3.5, 0.12), (1.8, 0.5), (0.5, 1.3), (0.38, 4.0), (0.42, 8.0), (0.9, 9.3), (3.2, 11.6),
                      (4.15, 14.6), (3.95, 18.0), (3.45, 21.0)], 10)
    lip = [(3.45, 21.0), (3.43, 21.07), (3.38, 21.1), (3.33, 21.07), (3.31, 21.0)]
    inside = spline([(3.31, 21.0), (3.8, 18.0), (4.0, 14.6), (3.05, 11.75), (0.8, 9.75), (0, 9.5)], 12)
    return lathe([outside, lip, inside], 128)


def bowl():
    outside = spline([(0, 0), (5.0, 0), (5.2, 0.7), (4.6, 1.3), (8.5, 3.4), (12.0, 7.2), (13.2, 10.2)], 10)
    rim = [(13.2, 10.2), (13.25, 10.4), (13.1, 10.5), (12.95, 10.4), (12.9, 10.2)]
    inside = spline([(12.9, 10.2), (11.7, 7.3), (8.3, 3.8), (4.0, 2.0), (0, 1.8)], 10)
    return lathe([outside, rim, inside], 128)


def jar():
    outside = spline([(0, 0), (5.4, 0), (5.7, 0.4), (5.7, 3), (5.6, 11.0), (5.9, 11.8)], 8)
    inside = spline([(5.9, 11.8), (5.7, 12.0), (5.3, 11.4), (5.3, 3), (5.1, 0.8), (0, 0.6)], 8)
    return lathe([outside, inside])


def lamp_foot():
    return lathe([spline([(0, 0), (6.6, 0), (6.8, 0.5), (6.2, 1.2), (2.2, 2.2), (1.0, 4.0), (0.8, 12.0), (1.0, 17.0), (2.6, 18.6), (2.8, 19.4)], 10),
                  [(2.8, 19.4), (2.5, 19.4), (0, 19.2)]])


def pear(seed):
    lump = Fractal(4, 4, 2, seed)
    body = lathe([spline([(0, 0.5), (1.2, 0.12), (2.6, 0.5), (3.7, 2.2), (3.75, 3.9), (2.9, 5.9), (1.9, 7.6), (1.55, 8.8), (1.0, 9.5), (0.25, 9.55), (0, 9.35)], 8)], 64)

    def bend(p):
        angle = (math.atan2(p[2], p[0]) / (2 * math.pi)) % 1.0
        swell = 1 + 0.09 * (lump.at(angle, p[1] / 12) - 0.5)
        lean = 0.012 * p[1] * p[1]
        return (p[0] * swell + lean, p[1], p[2] * swell)

    body.warped(bend)
    return body


def apple(seed):
    lump = Fractal(5, 3, 2, seed)
    body = lathe([spline([(0, 0.7), (0.7, 0.25), (1.8, 0.1), (3.2, 1.6), (3.9, 3.7), (3.6, 5.6), (2.3, 6.9), (1.1, 6.8), (0.35, 6.1), (0, 5.8)], 8)], 64)

    def swell(p):
        angle = (math.atan2(p[2], p[0]) / (2 * math.pi)) % 1.0
        s = 1 + 0.07 * (lump.at(angle, p[1] / 9) - 0.5) + 0.02 * math.cos(10 * math.pi * angle) * (p[1] / 7) ** 3
        return (p[0] * s, p[1], p[2] * s)

    return body.warped(swell)


def stalk(base, length, lean):
    path = [(base[0] + lean * (t / 8) ** 2, base[1] + length * t / 8, base[2] + 0.4 * lean * (t / 8)) for t in range(9)]
    return tube(path, lambda t: 0.16 + 0.10 * t ** 4, 10)


def brush(length, handle):
    """A brush along +y: handle, ferrule, bristles; three meshes."""
    h = length
    wood = lathe([spline([(0, 0), (0.16 * handle, 0.2), (0.3 * handle, 0.3 * h), (0.42 * handle, 0.62 * h), (0.32 * handle, 0.8 * h)], 6)], 20)
    ferrule = lathe([[(0.34 * handle, 0.79 * h), (0.36 * handle, 0.8 * h), (0.42 * handle, 0.9 * h), (0.40 * handle, 0.905 * h)]], 20)
    hair = lathe([spline([(0.38 * handle, 0.9 * h), (0.52 * handle, 0.94 * h), (0.34 * handle, 0.98 * h), (0, h)], 6)], 20)
    return wood, ferrule, hair


def cloth():
    """Linen over the table's front edge: flat on the table with long folds, hanging beyond z = 36."""
    noise = Noise(6, 5, 5)
    crumple = Fractal(7, 6, 3, 17)

    def point(u, v):
        x, run = -58 + 47 * u + 3.0 * (v - 0.5) * math.sin(3 * u), -8 + 74 * v
        x += 1.6 * math.sin(5.2 * v + 1.0) * (1 - u)
        # Folds fan out from the bowl; smooth humps, flattened where they touch the wood
        fold = (0.5 + 0.5 * math.sin(2 * math.pi * (3.2 * u + 0.35 * math.sin(4.0 * v)) + 1.4)) ** 3
        lift = 1.25 * fold * (0.35 + 0.65 * v) + 0.5 * (noise.at(u, v) - 0.5) + 0.35 * crumple.at(u, v)
        under_bowl = math.exp(-(((x + 33) ** 2 + (run - 6) ** 2) / 95.0))
        lift = max(lift * (1 - under_bowl), 0.0) + 0.12
        edge, radius = 35.8, 1.6
        if run <= edge:
            return (x, lift, run)
        bend = min((run - edge) / radius, math.pi / 2)
        drop = max(run - edge - radius * math.pi / 2, 0.0)
        away = radius + lift
        sway = (2.6 * fold + 1.1 * math.sin(9 * u + 2)) * min(drop / 14.0, 1.0)
        return (x, -radius + away * math.cos(bend) - drop, edge + away * math.sin(bend) + sway)

    return sheet(lambda u, v: point(u, v), 120, 140)


def leaf():
    """A pointed leaf along +x, slightly folded and bent; both sides show."""
    def point(u, v):
        width = 0.62 * math.sin(math.pi * u ** 0.8) * (1 - 0.25 * u)
        across = 2 * v - 1
        return (3.6 * u, 0.35 * abs(across) * width - 0.55 * u * u, across * width)

    return sheet(point, 10, 4)


def branches():
    """Olive twigs in the vase; returns the wood and the placement of each leaf."""
    rng = random.Random(12)
    wood, placed = Mesh(), []
    for k in range(9):
        turn = 2 * math.pi * k / 9 + rng.uniform(-0.35, 0.35)
        reach, height = rng.uniform(11, 22), rng.uniform(11, 19)
        if k in (0, 1):  # towards the image's right edge of the vase: keep low, the canvas stands there
            reach, height = 14, 12
        path = []
        for i in range(15):
            t = i / 14
            out_by = 1.4 + reach * t ** 1.5
            path.append((out_by * math.cos(turn + 0.3 * t), 24 + height * (t - 0.30 * t * t) + 4 * t, out_by * math.sin(turn + 0.3 * t)))
        wood.add(tube(path, lambda t: 0.26 - 0.19 * t, 8))
        for i in range(4, 15):
            for side in (-1, 1):
                p, q = path[i], path[i - 1]
                heading = math.atan2(p[2] - q[2], p[0] - q[0]) + side * rng.uniform(0.5, 1.1)
                placed.append((p, math.degrees(heading), rng.uniform(10, 55), rng.uniform(-35, 35), rng.uniform(1.0, 1.7)))
    return wood, placed


def quaternion(yaw_deg, pitch_deg, roll_deg):
    """Turn about x by roll, about z by pitch, about −y by yaw, in this order; (w, x, y, z)."""
    def product(a, b):
        return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])

    y, p, r = (math.radians(d) / 2 for d in (-yaw_deg, pitch_deg, roll_deg))
    return product((math.cos(y), 0, math.sin(y), 0), product((math.cos(p), 0, 0, math.sin(p)), (math.cos(r), math.sin(r), 0, 0)))


def leaf_instancer(placed):
    def tuples(rows):
        return ", ".join("(" + ", ".join(f"{x:.4g}" for x in row) + ")" for row in rows)

    prototype = usd_mesh("Leaf", leaf(), "    ", double_sided=True)
    return "\n".join([
        'def PointInstancer "Leaves"', "{",
        "    rel prototypes = <Leaf>",
        f"    int[] protoIndices = [{', '.join('0' for _ in placed)}]",
        f"    point3f[] positions = [{tuples(p[0] for p in placed)}]",
        f"    quath[] orientations = [{tuples(quaternion(p[1], p[2], p[3]) for p in placed)}]",
        f"    float3[] scales = [{tuples((p[4],) * 3 for p in placed)}]",
        prototype + "}", ""])


# ---- images ---------------------------------------------------------------------------------------------------

def write_image(name, width, height, color):
    """color(s, t) → scene-linear rgb; t = 0 is the bottom row, as texture coordinates count."""
    pixels = bytearray()
    for y in range(height):
        for x in range(width):
            pixels += bytes(encode_srgb(c) for c in color((x + 0.5) / width, 1 - (y + 0.5) / height))
    write_png(out / name, width, height, bytes(pixels))


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def wood_color():
    grain, fiber, tone = Fractal(3, 10, 3, 21), Noise(10, 300, 33), Noise(1, 5, 4)
    planks = 5

    def color(s, t):
        plank = int(t * planks)
        across = t * planks - plank
        rings = grain.at(s + 0.37 * plank, t) * 9 + across * 2.2
        ring = abs((rings % 1.0) - 0.5) * 2
        c = mix((0.105, 0.042, 0.016), (0.30, 0.15, 0.065), 0.25 + 0.6 * ring)
        c = mix(c, (0.05, 0.02, 0.01), 0.38 * fiber.at(s, t))
        shade = 0.78 + 0.44 * tone.lattice[plank][0]
        gap = min(across, 1 - across)
        if gap < 0.012:
            shade *= 0.25 + 0.75 * gap / 0.012
        return tuple(shade * x for x in c)

    return color


def plaster_color():
    cloud, grit = Fractal(4, 3, 4, 8), Noise(180, 140, 9)

    def color(s, t):
        v = 0.82 + 0.30 * (cloud.at(s, t) - 0.5) + 0.07 * (grit.at(s, t) - 0.5)
        warm = cloud.at(t, s)
        return (0.62 * v, (0.585 - 0.02 * warm) * v, (0.535 - 0.05 * warm) * v)

    return color


def linen_color():
    wave, slub = Noise(9, 7, 2), Noise(60, 4, 3)

    def color(s, t):
        warp = 0.5 + 0.5 * math.sin(2 * math.pi * s * 120)
        weft = 0.5 + 0.5 * math.sin(2 * math.pi * t * 180)
        v = 0.86 + 0.06 * warp * weft + 0.10 * (wave.at(s, t) - 0.5) + 0.05 * (slub.at(s, t) - 0.5)
        c = (0.70 * v, 0.665 * v, 0.60 * v)
        # Two woven stripes along the hems
        hem = min(s, 1 - s)
        if 0.045 < hem < 0.062 or 0.072 < hem < 0.080:
            c = mix(c, (0.10, 0.16, 0.30), 0.8)
        return c

    return color


def painting_color():
    """A small landscape, laid in glazes: sky, sun, three ranges of hills, water."""
    cloud, ridge, stroke = Fractal(3, 6, 3, 40), Fractal(3, 1, 4, 41), Noise(40, 160, 42)

    def color(s, t):
        s += 0.004 * (stroke.at(s, t) - 0.5)
        c = mix((0.80, 0.50, 0.24), (0.16, 0.30, 0.44), min(max((t - 0.42) / 0.5, 0), 1))
        c = mix(c, (0.86, 0.66, 0.46), 0.55 * max(cloud.at(s, t) - 0.45, 0) * 2)
        sun = math.hypot((s - 0.66) * 1.3, t - 0.60)
        c = mix(c, (1.0, 0.72, 0.30), math.exp(-(sun / 0.10) ** 2))
        for k, (base, hue) in enumerate((((0.50), (0.24, 0.25, 0.33)), ((0.42), (0.13, 0.19, 0.21)), ((0.32), (0.05, 0.10, 0.08)))):
            crest = base + (0.20 - 0.03 * k) * (ridge.at(s * (0.6 + 0.3 * k) + 0.31 * k, 0.3 * k) - 0.42)
            if t < crest:
                c = mix(c, hue, 0.88)
        if t < 0.22:
            ripple = stroke.at(s * 0.4, t * 1.7)
            c = mix((0.10, 0.17, 0.21), (0.75, 0.48, 0.25), 0.25 + 0.5 * math.exp(-((s - 0.64) / 0.13) ** 2) * ripple)
        v = 0.9 + 0.2 * stroke.at(s, t)
        return tuple(v * x for x in c)

    return color


def cover_color():
    """A cloth-bound book with a stamped frame and title bars; used on the covers seen from above."""
    weave = Noise(160, 220, 50)

    def color(s, t):
        c = mix((0.23, 0.028, 0.022), (0.30, 0.045, 0.035), weave.at(s, t))
        edge = min(s, 1 - s, t, 1 - t)
        gold = 0.055 < edge < 0.068 or (0.30 < s < 0.70 and (0.66 < t < 0.69 or 0.61 < t < 0.625))
        return (0.62, 0.43, 0.13) if gold else c

    return color


def pear_color():
    blush, speck = Fractal(3, 3, 2, 60), Noise(70, 50, 61)

    def color(s, t):
        c = mix((0.42, 0.36, 0.045), (0.50, 0.11, 0.03), min(max(2.2 * (blush.at(s, t) - 0.42), 0), 1) * 0.85)
        return mix(c, (0.12, 0.07, 0.02), 0.8 if speck.at(s, t) > 0.93 else 0.0)

    return color


def apple_color():
    streak, ground = Noise(46, 3, 70), Fractal(3, 2, 2, 71)

    def color(s, t):
        c = mix((0.44, 0.018, 0.012), (0.46, 0.20, 0.03), min(max(1.6 * (ground.at(s, t) - 0.45), 0), 1))
        c = mix(c, (0.55, 0.24, 0.07), 0.30 * streak.at(s, t))
        return mix(c, (0.30, 0.26, 0.03), max(0.0, (t - 0.86) / 0.14) * 0.8)

    return color


# ---- the whole --------------------------------------------------------------------------------------------------

def write_props():
    wood, placed = branches()
    parts = ["#usda 1.0\n(\n    metersPerUnit = 0.01\n    upAxis = \"Y\"\n)\n"]
    single = {"Vase": vase(), "WineGlass": wine_glass(), "Bowl": bowl(), "Jar": jar(), "LampFoot": lamp_foot(), "Twigs": wood}
    for name, mesh in single.items():
        parts.append(usd_mesh(name, mesh))
    parts.append(usd_mesh("Cloth", cloth(), double_sided=True))
    parts.append(leaf_instancer(placed))
    for name, body, stem in (("PearA", pear(1), ((1.05, 9.3, 0), 2.1, 0.9)), ("PearB", pear(2), ((1.05, 9.3, 0), 1.8, -0.6)),
                             ("Apple", apple(3), ((0, 5.9, 0), 2.2, 0.5))):
        stem_mesh = stalk(*stem)
        parts.append(f'def Xform "{name}"\n{{\n' + usd_mesh("Body", body, "    ") + usd_mesh("Stalk", stem_mesh, "    ") + "}\n")
    handle, ferrule, hair = brush(26, 1.0)
    parts.append('def Xform "Brush"\n{\n' + usd_mesh("Handle", handle, "    ") + usd_mesh("Ferrule", ferrule, "    ")
                 + usd_mesh("Hair", hair, "    ") + "}\n")
    cover, pages = rounded_box((24, 3.6, 17), 0.35), rounded_box((23.2, 2.9, 16.4), 0.1)
    parts.append('def Xform "Book"\n{\n' + usd_mesh("Upper", rounded_box((24, 0.4, 17), 0.18).moved((0, 1.6, 0)), "    ")
                 + usd_mesh("Lower", rounded_box((24, 0.4, 17), 0.18).moved((0, -1.6, 0)), "    ")
                 + usd_mesh("Spine", rounded_box((0.6, 3.6, 17), 0.28).moved((-11.9, 0, 0)), "    ")
                 + usd_mesh("Pages", pages.moved((0.1, 0, 0)), "    ") + "}\n")
    parts.append(usd_mesh("TableTop", rounded_box((170, 4, 78), 0.7).moved((0, -2, 0))))
    parts.append(usd_mesh("Board", rounded_box((44, 34, 2), 0.25)))
    parts.append(usd_mesh("Palette", lathe([spline([(0, 0), (12.0, 0), (12.3, 0.3), (12.0, 0.6), (11.6, 0.6)], 6), [(11.6, 0.6), (0, 0.6)]], 96)))
    (out / "props.usda").write_text("\n".join(parts))


def write_sky():
    """Light of a wide room with openings to a clear sky: dim below, brighter towards the top."""
    width, height = 256, 128
    sky = Sky(32, 140, 3.0)
    rows = []
    for y in range(height):
        row = []
        for x in range(width):
            d = lat_long_direction(x, y, width, height)
            if d[1] > 0:
                row.append(tuple(0.35 * c for c in sky.radiance(d)))
            else:
                # Floor of the room: what comes back from old boards
                row.append(tuple(c * (1 + 0.6 * d[1]) for c in (0.075, 0.06, 0.048)))
        rows.append(row)
    write_hdr(out / "sky.hdr", width, height, rows)


if __name__ == "__main__":
    out.mkdir(exist_ok=True)
    write_props()
    write_sky()
    write_image("wood.png", 900, 450, wood_color())
    write_image("plaster.png", 512, 320, plaster_color())
    write_image("linen.png", 480, 640, linen_color())
    write_image("painting.png", 440, 340, painting_color())
    write_image("cover.png", 300, 212, cover_color())
    write_image("pear.png", 256, 192, pear_color())
    write_image("apple.png", 256, 192, apple_color())
