#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders hard cases beside what they must equal. Usage: tests/hardcases/case_images.py [--bin FOLDER] [--keep FOLDER] [--only H07…]
[-o FILE.jpg]

Writes small scenes, renders each, compares those that must be the same, and puts all images on one sheet, docs/engineering/hard_cases.jpg.
Fails where images that must agree to the bit do not, or others are further apart than they may be. --keep leaves scenes, layers
and images in a folder, --only makes the rows of some cases.
"""
import argparse
import json
import math
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scenes/tools"))

from contact_sheet import sheet  # noqa: E402
from images import write_hdr  # noqa: E402

SHEET = ROOT / "docs/engineering/hard_cases.jpg"
COLUMNS, WIDTH, HEIGHT, SAMPLES = 4, 416, 272, 16


@dataclass
class Cell:
    """One image. `like` names the cell that it must equal, `bound` is the largest relMSE to it; 0: to the bit.

    `options` are those of the render, `mix` those of the mix, `edit` is what oiiotool does with the mixed image.
    """
    name: str
    caption: str
    scene: str
    like: str = ""
    bound: float = 0
    options: tuple = ("--layers", "none")
    mix: tuple = ()
    edit: tuple = ()
    is_shown: bool = True


# Scenes as text

def usda(*prims, ops=""):
    """A layer with everything under one prim, which `ops` place."""
    return '#usda 1.0\n(\n    defaultPrim = "Root"\n    upAxis = "Y"\n)\ndef Xform "Root"\n{\n' + ops + "\n".join(prims) + "}\n"


def ops(**values):
    """Transform ops in the order that they are given: translate, rotateX, scale …"""
    kinds = {"translate": "double3", "scale": "double3"}
    lines = [f"    {kinds.get(name, 'float')} xformOp:{name}{'' if str(value).startswith('.') else ' = '}{value}\n" for name, value in values.items()]
    order = ", ".join(f'"xformOp:{name}"' for name in values)
    return "".join(lines) + (f"    uniform token[] xformOpOrder = [{order}]\n" if values else "")


def prim(kind, name, *lines, look="", **placed):
    """`look` is a color, or the name of a material."""
    text = [f"    {line}\n" for line in lines]
    api = ""
    if isinstance(look, tuple):
        text.append(f"    color3f[] primvars:displayColor = [{look}]\n")
    elif look:
        text.append(f"    rel material:binding = </Root/{look}>\n")
        api = ' (prepend apiSchemas = ["MaterialBindingAPI"])'
    return f'def {kind} "{name}"{api}\n{{\n' + "".join(text) + ops(**placed) + "}\n"


def camera(*lines, focal=24, **placed):
    return prim("Camera", "Cam", f"float focalLength = {focal}", "float2 clippingRange = (0.001, 1e12)", *lines, **placed)


def mesh(name, points, faces, *lines, look="", scheme="none", **placed):
    counts, indices = [len(face) for face in faces], [v for face in faces for v in face]
    return prim("Mesh", name, f"int[] faceVertexCounts = {counts}", f"int[] faceVertexIndices = {indices}",
                f"point3f[] points = [{', '.join(map(str, points))}]", f'uniform token subdivisionScheme = "{scheme}"', *lines, look=look, **placed)


def sheet_of(name, corners, *lines, look=""):
    return mesh(name, corners, [[0, 1, 2, 3]], *lines, look=look)


def floor(half=20, look=(0.6, 0.6, 0.6)):
    return sheet_of("Floor", [(-half, 0, half), (half, 0, half), (half, 0, -half), (-half, 0, -half)], look=look)


def ball(name, radius, at, look=""):
    return prim("Sphere", name, f"double radius = {radius}", look=look, translate=at)


def material(name, *inputs, more=()):
    shader = prim("Shader", "S", 'uniform token info:id = "UsdPreviewSurface"', *inputs, "token outputs:surface", "token outputs:displacement")
    return prim("Material", name, f"token outputs:surface.connect = </Root/{name}/S.outputs:surface>", shader, *more)


def glass(name, roughness=0, priority=0, ior=1.5):
    return material(name, "float inputs:opacity = 0", f"float inputs:ior = {ior}", f"float inputs:roughness = {roughness}",
                    "bool inputs:velatura:roughTransmission = 1", f"int inputs:velatura:dielectricPriority = {priority}")


def metal(name, roughness, color=(1, 1, 1)):
    return material(name, f"color3f inputs:diffuseColor = {color}", "float inputs:metallic = 1", f"float inputs:roughness = {roughness}")


def textured(name, file, *texture, outputs="rgb", constants=(), **inputs):
    """A material with inputs from an image, `diffuseColor="color3f"`, …, and constant ones; `texture` are lines of the reader."""
    reader = prim("Shader", "T", 'uniform token info:id = "UsdUVTexture"', f"asset inputs:file = @{file}@",
                  f"float2 inputs:st.connect = </Root/{name}/St.outputs:result>", f"float{'3' if outputs == 'rgb' else ''} outputs:{outputs}", *texture)
    st = prim("Shader", "St", 'uniform token info:id = "UsdPrimvarReader_float2"', 'string inputs:varname = "st"', "float2 outputs:result")
    lines = [f"{kind} inputs:{key}.connect = </Root/{name}/T.outputs:{outputs}>" for key, kind in inputs.items()]
    more = (reader, st) + ((f"token outputs:displacement.connect = </Root/{name}/S.outputs:displacement>",) if "displacement" in inputs else ())
    return material(name, *constants, *lines, more=more)


def lamp(kind, name, intensity, *lines, **placed):
    return prim(kind, name, f"float inputs:intensity = {intensity!r}", *lines, **placed)


def dome(intensity=1.0, *lines):
    return lamp("DomeLight", "Dome", intensity, *lines)


def aimed(light, yaw, pitch):
    """A light at (0, 0, distance) that shines along -Z, turned about the origin."""
    return prim("Xform", "Aim", light, rotateY=yaw, rotateX=pitch)


# Rows of the sheet

def room_prims():
    """The soft one of tests/identities: every coordinate lies on a grid of 2^-10, and no caustic hides a difference."""
    yield mesh("Floor", [(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3), (-3, 4, -3), (3, 4, -3)], [[0, 1, 2, 3], [3, 2, 5, 4]], look=(0.75, 0.5, 0.25))
    yield ball("Ball", 0.75, (-1, 0.75, 0), "Gloss")
    yield ball("Glass", 0.5, (0.25, 0.5, 1), "Clear")
    yield prim("Cube", "Block", "double size = 1", look="Brass", translate=(1.25, 0.5, 0), rotateY=30)
    yield sheet_of("Panel", [(-2.75, 1, -1.5), (-2.75, 1, 1.5), (-2.5, 3.5, 1.5), (-2.5, 3.5, -1.5)], look="Glow")
    yield material("Glow", "color3f inputs:emissiveColor = (2, 3, 4)")
    yield material("Gloss", "color3f inputs:diffuseColor = (0.2, 0.4, 0.8)", "float inputs:roughness = 0.3", "float inputs:clearcoat = 0.5")
    yield material("Clear", "float inputs:opacity = 0", "float inputs:roughness = 0")
    yield metal("Brass", 0.6, (0.9, 0.7, 0.3))
    yield lamp("RectLight", "Key", 6.0, "float inputs:width = 1", "float inputs:height = 2", translate=(2, 3, 2), rotateX=-60)
    yield lamp("SphereLight", "Lamp", 5.0, "float inputs:radius = 0.75", "color3f inputs:color = (1, 0.75, 0.5)", translate=(-2, 2.5, 1))
    yield lamp("DistantLight", "Sun", 2.0, "float inputs:angle = 60", rotateX=-50)
    yield dome(0.25)


def room(root="", more=(), camera_ops=None):
    return usda(camera(translate=(0, 1, 5), **(camera_ops or {})), *room_prims(), *more, ops=root)


def rooms(_):
    small = 2.0 ** -20
    yield Cell("origin", "h05 at the origin", room())
    yield Cell("far", "h05 moved by 1e8", room(ops(translate=(100000000, -100000000, 100000000))), "origin")
    yield Cell("small", "h06 by 2 to -20", room(ops(scale=(small, small, small))), "origin")
    yield Cell("mirror", "h08 flipped twice", room(ops(scale=(-1, 1, 1)), camera_ops={"scale": (-1, 1, 1)}), "origin", 0.04, edit=("--flop",))


def flats(_):
    def still(*prims):
        return usda(camera(translate=(0, 1.6, 6), rotateX=-8), *prims, ball("Ball", 0.75, (-1.2, 0.75, 0), (0.2, 0.4, 0.8)),
                    lamp("DistantLight", "Sun", 2000.0, "float inputs:angle = 2", rotateY=30, rotateX=-50), dome(0.5))

    table = [(-0.75, 1, 0.75), (0.75, 1, 0.75), (0.75, 1, -0.75), (-0.75, 1, -0.75)]
    sheet = mesh("Box", [(x + 1, y, z) for x, y, z in table], [[0, 1, 2, 3]], look=(0.8, 0.3, 0.1))
    box = prim("Cube", "Box", "double size = 1.5", look=(0.8, 0.3, 0.1), translate=(1, 1, 0), scale=(1, 0, 1))
    yield Cell("flat_box", "h09 box, height 0", still(floor(), box), "sheet", 1e-6)
    yield Cell("sheet", "h09 a sheet", still(floor(), sheet))
    yield Cell("wide", "h07 floor of 1e9", still(floor(1e9), box), "field", 0.001)
    yield Cell("field", "h07 floor of 1e4", still(floor(1e4), box))


def squares():
    """Each over several others in one plane."""
    numbers = random.Random(12)
    for i in range(24):
        x, y, size = numbers.uniform(-1.3, 1.3), numbers.uniform(-0.8, 0.8), 0.25 + i % 4 / 8
        corners = [(x - size, y - size, 0), (x + size, y - size, 0), (x + size, y + size, 0), (x - size, y + size, 0)]
        yield sheet_of(f"M{i * 11 % 24}", corners, look=(0.1 + 0.03 * i, 0.9 - 0.03 * i, 0.1 * (i % 8)))


def coarse_ball(rings, segments):
    """Facets with the normals of the sphere."""
    points, faces = [], []
    for i in range(rings + 1):
        for j in range(segments):
            theta, phi = math.pi * i / rings, 2 * math.pi * j / segments
            points.append((math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi)))
    for i in range(rings):
        for j in range(segments):
            a, b = i * segments + j, i * segments + (j + 1) % segments
            faces.append([a, b, b + segments, a + segments])
    normals = ", ".join(map(str, points))
    return mesh("Ball", points, faces, f'normal3f[] normals = [{normals}] (interpolation = "vertex")', look=(0.8, 0.8, 0.8))


def facets(_):
    plane, reverse = list(squares()), list(squares())[::-1]
    eye, near = camera(translate=(0, 0, 3.6)), camera(translate=(0, 0, 4), focal=26)
    lights = [lamp("SphereLight", "Lamp", 12000.0, "float inputs:radius = 0.05", translate=(-4, 3, 1)), dome(0.05)]
    yield Cell("order", "h12 one plane", usda(eye, dome(), *plane))
    yield Cell("other_order", "h12 another order", usda(dome(), *reverse, eye), "order")
    yield Cell("coarse", "h15 8x16 facets", usda(near, *lights, coarse_ball(8, 16)), "round", 0.015)
    yield Cell("round", "h15 a sphere", usda(near, *lights, ball("Ball", 1, (0, 0, 0), (0.8, 0.8, 0.8))))


def furnaces(_):
    """Balls of roughness 0, 0.5 and 1 before stripes, then in a dome of radiance 1 and nothing else."""
    eye = camera(translate=(0, 0, 7), focal=24)
    lit = [lamp("RectLight", "Key", 5.0, "float inputs:width = 4", "float inputs:height = 4", translate=(-4, 5, 4), rotateY=-45, rotateX=-42), dome(0.4),
           *(sheet_of(f"Stripe{i}", [(x, -3, -1.5), (x + 0.5, -3, -1.5), (x + 0.5, 3, -1.5), (x, 3, -1.5)], look=(0.1, 0.25, 0.4)) for i, x in enumerate(range(-6, 7)))]
    no_alpha = ("--ch", "R,G,B")
    yield Cell("nothing", "", usda(eye, dome()), edit=no_alpha, is_shown=False)
    for kind, make in (("metal", metal), ("glass", glass)):
        balls = [text for i in range(3) for text in (make(f"M{i}", i / 2), ball(f"B{i}", 0.9, (2 * (i - 1), 0, 0), f"M{i}"))]
        yield Cell(f"{kind}_lit", f"h20 {kind} balls", usda(eye, *balls, *lit))
        yield Cell(f"{kind}_white", f"h20 {kind}, dome", usda(eye, *balls, dome()), "nothing", 0.004, edit=no_alpha)


def distances(_):
    """One irradiance, 3, from one direction."""
    def still(light):
        return usda(camera(translate=(0, 2, 6), rotateX=-14), floor(), ball("Ball", 0.8, (-0.9, 0.8, 0), (0.8, 0.5, 0.2)),
                    prim("Cube", "Block", "double size = 1", look=(0.3, 0.5, 0.8), translate=(1.1, 0.5, 0.2), rotateY=25), aimed(light, 35, -50), dome(0.15))

    def sphere(distance, radius):
        return lamp("SphereLight", "Lamp", 3 / math.pi * (distance / radius) ** 2, f"float inputs:radius = {radius}", translate=(0, 0, distance))

    square = lamp("RectLight", "Lamp", 3e12, "float inputs:width = 1", "float inputs:height = 1", translate=(0, 0, 1000000))
    sun = lamp("DistantLight", "Lamp", 3e12 / math.pi, f"float inputs:angle = {math.degrees(2e-6)}")
    yield Cell("near", "h26 lamp at 6", still(sphere(6, 0.3)))
    yield Cell("remote", "h26 lamp at 1e6", still(sphere(1000000, 1)), "sun", 1e-6)
    yield Cell("square", "h24 square at 1e6", still(square), "sun", 1e-6)
    yield Cell("sun", "h26 a sun", still(sun))


SKY_WIDTH, SKY_HEIGHT, SUN_COLUMN, SUN_ROW = 1024, 512, 600, 128


def write_sky(folder, sun):
    """Radiance 3000 to 10000; the sun is one texel."""
    rows = []
    for y in range(SKY_HEIGHT):
        t = y / SKY_HEIGHT
        rows.append([(3000 + 4000 * t, 5000 + 3000 * t, 10000 - 2000 * t)] * SKY_WIDTH)
    if sun:
        rows[SUN_ROW][SUN_COLUMN] = (sun, sun, sun)
    write_hdr(folder / ("sun.hdr" if sun else "sky.hdr"), SKY_WIDTH, SKY_HEIGHT, rows)


def sun_of_the_texel():
    """The same light from the same direction, as a distant light: irradiance by the texel's solid angle."""
    longitude, latitude = 180 - 360 * (SUN_COLUMN + 0.5) / SKY_WIDTH, 90 - 180 * (SUN_ROW + 0.5) / SKY_HEIGHT
    solid_angle = 2 * math.pi / SKY_WIDTH * math.pi / SKY_HEIGHT * math.cos(math.radians(latitude))
    half_angle = math.acos(1 - solid_angle / (2 * math.pi))
    sun = lamp("DistantLight", "Sun", (1e9 - 6500) * 1e-4, f"float inputs:angle = {math.degrees(2 * half_angle)}")
    return aimed(sun, longitude, -latitude)


def skies(folder):
    def still(file, *more):
        return usda(camera(translate=(0, 2, 6), rotateX=-6), floor(), ball("Ball", 0.8, (-0.9, 0.8, 0), (0.8, 0.5, 0.2)), ball("Mirror", 0.6, (0.9, 0.6, 0.3), "Metal"),
                    metal("Metal", 0.3), dome(1e-4, f"asset inputs:texture:file = @./{file}@", 'token inputs:texture:format = "latlong"'), *more)

    write_sky(folder, 1e9)
    write_sky(folder, 0)
    yield Cell("texel", "h27 texel of 1e9", still("sun.hdr"), "beside", 0.002)
    yield Cell("beside", "h27 sky and sun", still("sky.hdr", sun_of_the_texel()))
    yield from seams(folder)


def cube():
    points = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    return points, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def seams(folder):
    """A body with creases, and a seam of the texture that moves its surface at every edge: light within would show any crack."""
    waves = [[(0.5 + 0.5 * math.sin(0.6 * x) * math.cos(0.45 * y),) * 3 for x in range(64)] for y in range(64)]
    write_hdr(folder / "waves.hdr", 64, 64, waves)
    points, faces = cube()
    st = ", ".join(["(0, 0), (1, 0), (1, 1), (0, 1)"] * len(faces))
    body = mesh("Body", points, faces, f'texCoord2f[] primvars:st = [{st}] (interpolation = "faceVarying")', "int[] creaseIndices = [2, 3, 7, 6, 2]",
                "int[] creaseLengths = [5]", "float[] creaseSharpnesses = [10]", look="Waves", scheme="catmullClark", rotateX=20, rotateY=30)
    waves = textured("Waves", "./waves.hdr", "float4 inputs:scale = (0.15, 0.15, 0.15, 0.15)", outputs="r", displacement="float",
                     constants=("color3f inputs:diffuseColor = (0.8, 0.6, 0.35)",))
    scene = usda(camera(translate=(0, 0, 4.6)), body, waves, lamp("SphereLight", "within", 100000.0, "float inputs:radius = 0.1"),
                 lamp("SphereLight", "outside", 100.0, "float inputs:radius = 0.5", translate=(-3, 4, 3)), dome(0.2))
    light = ("--layers", "light")
    yield Cell("seams", "h13 a lamp within", scene, options=light)
    yield Cell("black", "", scene, options=light, mix=("--gain", "all=0"), is_shown=False)
    yield Cell("within", "h13 what leaks", scene, "black", options=light, mix=("--solo", "within"))


def jars(_):
    """A jar of glass with water and a stick in it. The water reaches into the glass, touches it or leaves a gap."""
    def jar(reach, priorities=(2, 1)):
        def tube(name, radius, bottom, top, look, *lines):
            return prim("Cylinder", name, 'uniform token axis = "Y"', f"double radius = {radius}", f"double height = {top - bottom}", *lines, look=look,
                        translate=(0, (top + bottom) / 2, 0))
        stripes = [sheet_of(f"Stripe{i}", [(-3 + i, 0, -2), (-2.5 + i, 0, -2), (-2.5 + i, 3, -2), (-3 + i, 3, -2)], look=(0.7, 0.2, 0.1)) for i in range(6)]
        stick = prim("Cylinder", "Stick", 'uniform token axis = "Y"', "double radius = 0.06", "double height = 1.75", look=(0.1, 0.5, 0.2), translate=(0, 1.05, 0), rotateZ=-18)
        return usda(camera(translate=(0, 1.9, 4.6), rotateX=-10), floor(look=(0.7, 0.7, 0.7)), *stripes, stick, glass("Glass", priority=priorities[0]),
                    glass("Water", priority=priorities[1], ior=1.33), tube("Outer", 0.9, 0.001, 2.2, "Glass"),
                    tube("Inner", 0.75, 0.15, 2.05, "Glass", 'uniform token orientation = "leftHanded"'), tube("Water0", 0.75 + reach, 0.15 - reach, 1.4, "Water"), dome())

    yield Cell("reach", "h41 overlapping", jar(0.05))
    yield Cell("touch", "h41 touching", jar(0), "reach", 0.004)
    yield Cell("gap", "h41 with a gap", jar(-0.02))
    yield Cell("unranked", "h41 no priorities", jar(0, (0, 0)))


def spins(_):
    """Two blades that turn while the shutter is open."""
    def spinner(turn, closes):
        corners = [(0, 0, 0), (1.5, -0.5, 0), (1.5, 0.5, 0), (-1.5, 0.5, 0), (-1.5, -0.5, 0)]
        wall = sheet_of("Wall", [(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)], look=(0.02, 0.03, 0.05))
        rotation = f".timeSamples = {{ 0: 20, 1: {20 + turn} }}" if turn else 20
        blades = mesh("Blades", corners, [[0, 1, 2], [0, 3, 4]], look=(0.8, 0.3, 0.1), rotateZ=rotation)
        return usda(camera("double shutter:open = 0", f"double shutter:close = {closes}", translate=(0, 0, 5.4)), wall, blades, dome())

    frame = ("--layers", "none", "-f", "0")
    yield Cell("still", "h47 at rest", spinner(0, 1), options=frame)
    yield Cell("closed", "h47 closed", spinner(180, 0), "still", options=frame)
    yield Cell("half_turn", "h47 half a turn", spinner(180, 1), options=frame)
    yield Cell("whole_turn", "h47 a whole turn", spinner(360, 1), "half_turn", 0.02, options=frame)


def lenses(_):
    def row_of_balls(*lines, **placed):
        balls = [ball(f"B{i}", 0.45, (-1.8 + 0.9 * i, 0.45, 2.4 - 1.6 * i), (0.2 + 0.15 * i, 0.4, 0.8 - 0.15 * i)) for i in range(5)]
        return usda(camera(*lines, **{"translate": (0, 1.4, 6.5), "rotateX": -10, **placed}), floor(), *balls,
                    lamp("RectLight", "Key", 25.0, "float inputs:width = 2", "float inputs:height = 2", translate=(-3, 5, 4), rotateY=-35, rotateX=-45), dome(0.6))

    yield Cell("pinhole", "h48 pinhole", row_of_balls())
    yield Cell("focus_0", "h48 focus at 0", row_of_balls("float fStop = 2.4", "float focusDistance = 0"), "pinhole")
    yield Cell("lens", "h48 lens, focus 7", row_of_balls("float fStop = 2.4", "float focusDistance = 7.4"))
    yield Cell("small_lens", "h48 fstop of 1e9", row_of_balls("float fStop = 1e9", "float focusDistance = 7.4"), "pinhole", 1e-6)


def write_exr(path, width, height, value):
    """Three float channels without compression; value(x, y) = (r, g, b), row 0 on top."""
    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

    channels = b"".join(c + b"\0" + struct.pack("<iBxxxii", 2, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    head = struct.pack("<ii", 20000630, 2) + attribute("channels", "chlist", channels) + attribute("compression", "compression", b"\0")
    head += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window) + attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1)) + attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    rows = []
    for y in range(height):
        pixels = [value(x, y) for x in range(width)]
        data = b"".join(struct.pack(f"<{width}f", *(p[c] for p in pixels)) for c in (2, 1, 0))
        rows.append(struct.pack("<ii", y, len(data)) + data)
    first = len(head) + 8 * height
    offsets = [first + y * len(rows[0]) for y in range(height)]
    path.write_bytes(head + struct.pack(f"<{height}Q", *offsets) + b"".join(rows))


FALLBACK = (0.8, 0.2, 0.6)


def write_tiles(folder):
    """Four tiles of a checkerboard: with holes that are NaN or 0, whole, without the last, with the fallback as the last."""
    def board(hole):
        def value(x, y):
            if hole is not None and (x // 4, y // 4) in ((3, 5), (9, 2), (12, 12), (6, 10)):
                return (hole,) * 3
            return (0.7, 0.6, 0.3) if (x // 8 + y // 8) % 2 else (0.2, 0.3, 0.5)
        return value

    for name, hole in (("nan", math.nan), ("zero", 0.0), ("gap", None), ("full", None)):
        for tile in (1001, 1002, 1011, 1012):
            if tile == 1012 and name == "gap":
                continue
            plain = tile == 1012 and name == "full"
            write_exr(folder / f"{name}.{tile}.exr", 64, 64, (lambda x, y: FALLBACK) if plain else board(hole))


def textures(folder):
    def board(name):
        corners = [(-1.6, 0, 0.9), (1.6, 0, 0.9), (1.6, 0, -1.6), (-1.6, 0, -1.6)]
        st = 'texCoord2f[] primvars:st = [(0, 0), (2, 0), (2, 2), (0, 2)] (interpolation = "vertex")'
        return usda(camera(translate=(0, 2.1, 1.1), rotateX=-55), sheet_of("Board", corners, st, look="Checks"),
                    textured("Checks", f"./{name}.<UDIM>.exr", f"float4 inputs:fallback = {FALLBACK + (1,)}", diffuseColor="color3f"), dome())

    write_tiles(folder)
    yield Cell("nan", "h52 nan in texels", board("nan"), "zero")
    yield Cell("zero", "h52 zero texels", board("zero"))
    yield Cell("tile_gap", "h52 tile missing", board("gap"), "full", 1e-12)
    yield Cell("full", "h52 its fallback", board("full"))


ROWS = {("H05", "H06", "H08"): rooms, ("H07", "H09"): flats, ("H12", "H15"): facets, ("H20",): furnaces, ("H24", "H26"): distances,
        ("H13", "H27"): skies, ("H41",): jars, ("H47",): spins, ("H48",): lenses, ("H52",): textures}


# Renders and comparisons

class Studio:
    """Renders cells, and keeps what was rendered of a scene for other mixes of it."""

    def __init__(self, programs, folder):
        self.velatura, self.comp, self.folder = programs / "velatura", programs / "velatura-comp", folder
        self.rendered = {}

    def run(self, *command, codes=(0,)):
        done = subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace")
        if done.returncode not in codes:
            sys.exit(f"{' '.join(map(str, command))}\nexit code {done.returncode}\n{done.stdout}{done.stderr}")
        if done.stderr:
            print(done.stderr, end="", file=sys.stderr)
        return done.stdout

    def render(self, name, scene, options):
        if (scene, options) not in self.rendered:
            source, layers = self.folder / f"{name}.usda", self.folder / f"{name}.layers.exr"
            source.write_text(scene)
            self.run(self.velatura, "render", source, "-o", layers, "--res", WIDTH, HEIGHT, "--spp", SAMPLES, "--progress", "none", "--strict", *options)
            self.rendered[scene, options] = layers
        return self.rendered[scene, options]

    def image(self, cell):
        """Scene-linear beside what a monitor shows."""
        layers, linear, shown = self.render(cell.name, cell.scene, cell.options), self.folder / f"{cell.name}.exr", self.folder / f"{cell.name}.png"
        self.run(self.comp, "mix", layers, "-o", linear, "-q", *cell.mix)
        if cell.edit:
            self.run("oiiotool", linear, *cell.edit, "-o", linear)
        self.run(self.comp, "mix", linear, "-o", shown, "-q")
        return shown

    def difference(self, name, other):
        """Whether two beauties agree to the bit, and their relMSE."""
        told = json.loads(self.run(self.comp, "diff", self.folder / f"{name}.exr", self.folder / f"{other}.exr", "--json", codes=(0, 4)))
        return told["equal"], told["worstRelMse"]


def check(studio, cell):
    """Says how far a cell is from what it must equal. Returns: whether it is near enough."""
    is_equal, error = studio.difference(cell.name, cell.like)
    is_kept = is_equal if cell.bound == 0 else error <= cell.bound
    said = "the same to the bit" if is_equal else f"relMSE {error:.2g}"
    bound = "to the bit" if cell.bound == 0 else f"{cell.bound:g}"
    print(f"{cell.caption:18} {said:20} of {cell.like}, bound {bound}{'' if is_kept else ': NOT KEPT'}", flush=True)
    return is_kept


def draw(studio, rows):
    """Returns: [(caption, image)], and whether all bounds were kept."""
    images, is_kept = [], True
    for row in rows:
        cells = list(row(studio.folder))
        shown = [(cell, studio.image(cell)) for cell in cells]
        images += [(cell.caption, image) for cell, image in shown if cell.is_shown]
        is_kept = all([check(studio, cell) for cell in cells if cell.like]) and is_kept
    return images, is_kept


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release/bin", help="folder of velatura and velatura-comp")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for scenes, layers and images")
    parser.add_argument("--only", nargs="+", metavar="CASE", help="the rows of these cases alone")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=SHEET)
    arguments = parser.parse_args()
    rows = [row for cases, row in ROWS.items() if not arguments.only or set(cases) & set(arguments.only)]
    if not (arguments.bin / "velatura").exists():
        parser.error(f"no velatura in {arguments.bin}: ./dev build makes it")
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.keep or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        studio = Studio(arguments.bin, folder)
        images, is_kept = draw(studio, rows)
        sheet(images, folder / "sheet.png", COLUMNS)
        studio.run("oiiotool", folder / "sheet.png", "--quality", 90, "-o", arguments.output)
    print(f"{len(images)} images in {time.monotonic() - begin:.0f} s, " + ("all as they should be" if is_kept else "NOT as they should be"))
    sys.exit(0 if is_kept else 1)


if __name__ == "__main__":
    main()
