#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the seeds of tests/fuzz/seeds that are no text: make_seeds.py VELATURA, the program that makes .usdc and .exr. Run by the
Python that Debian's OpenImageIO and pyopenvdb belong to."""
import json
import pathlib
import random
import struct
import subprocess
import sys
import zlib

here = pathlib.Path(__file__).resolve().parent / "seeds"
scene = """#usda 1.0
def Camera "C"
{
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "sky"
{
}
def Sphere "Ball" (kind = "component")
{
    color3f[] primvars:displayColor = [(0.5, 0.25, 1)]
    double radius.timeSamples = { 0: 1, 1: 2 }
}
"""


def write(format, name, data):
    (here / format).mkdir(parents=True, exist_ok=True)
    (here / format / name).write_bytes(data)


def stored_zip(members):
    """Members at multiples of 64 bytes, as .usdz has them."""
    body, index = b"", b""
    for name, data in members:
        at = len(body)
        extra = -(at + 30 + len(name) + 4) % 64
        field = struct.pack("<HH", 0x1986, extra) + bytes(extra)
        numbers = (20, 0, 0, 0, 33, zlib.crc32(data), len(data), len(data), len(name))
        body += struct.pack("<4sHHHHHIIIHH", b"PK\3\4", *numbers, len(field)) + name + field + data
        index += struct.pack("<4sHHHHHHIIIHHHHHII", b"PK\1\2", 20, *numbers, 0, 0, 0, 0, 0, at) + name
    return body + index + struct.pack("<4sHHHHIIH", b"PK\5\6", 0, 0, len(members), len(members), len(index), len(body), 0)


def sums():
    """Two pixels with their sums, as image_input.h reads it; the digest is the fuzzer's."""
    set = {"lastBounce": 1, "bounces": True, "groups": True, "matrix": False, "shadow": False, "data": True, "halves": False, "float": False,
           "mattes": ["object"], "matteLevels": 2, "lights": [{"name": "key", "prims": ["/key"], "dome": False}]}
    text = json.dumps({"schema": "velatura.sums/2", "layerSet": set, "sha256": ""})
    data = b"\1\0Avelatura/sums\0" + text.encode() + b"\0"
    words = {"sums_first": (0, 2), "sums_end": (3, 4), "sums_invalid": (0, 1), "sums_primId": (7, 0), "sums_instanceId": (0, 0), "sums_hasIds": (1, 0),
             "sums0_0.x1": (0x3FF00000, 0x40000000), "sums1_0.y1": (0x3FF00000, 0), "sums0_1.z1": (0x3FF00000, 0x3FF00000)}
    for name, values in words.items():
        data += b"U" + name.encode() + b"\0" + struct.pack("<2I", *values)
    return data


def report():
    """Of a study, with what comparisons read."""
    all = {"value": 0.5, "low": 0.25, "high": 1}
    settings = [{"knob": knob, "value": "1", "options": "--way " + knob, "verdict": "better", "cpu_s": 2, "error_ratio_at_equal_time": all} for knob in ("", "spp")]
    return json.dumps({"schema": "velatura.study/1", "scene": "a.usda", "build": "b", "date": "c", "noise": all, "bias": 0.1, "settings": settings}).encode()


def tally():
    """Sizes and numbers of a study of a pixel by one setting and one layer, in the order of tally_file.cpp."""
    count = lambda n: struct.pack("<Q", n)
    numbers = lambda *v: count(len(v)) + struct.pack("<%dd" % len(v), *v)
    moments = numbers(1, 2, 3) + numbers(1, 4, 9) + struct.pack("<i", 1)
    setting = count(1) + count(4) + moments + numbers(0.5) + struct.pack("<d", 12) + moments + count(1) + struct.pack("<i", 0) + struct.pack("<dd", 0, 0) + count(2) + b"no"
    return struct.pack("<iiid", 1, 1, 1, 0.5) + count(1) + setting + count(1) + b"\1" + count(2) + b"b0" + moments + moments


def textures():
    """Small images of every kind that texture_fuzz.cpp knows, after the kind's number."""
    import numpy
    import OpenImageIO as oiio

    pixels = numpy.linspace(0, 1, 8 * 6 * 4, dtype=numpy.float32).reshape(6, 8, 4)
    kinds = {"png": "uint8", "jpg": "uint8", "hdr": "float", "exr": "half", "tif": "uint16", "tx": "uint8"}
    for number, (kind, format) in enumerate(kinds.items()):
        file = str(here / ("scratch." + kind))
        channels = 3 if kind in ("jpg", "hdr") else 4
        if kind == "tx":
            picture = oiio.ImageBuf(oiio.ImageSpec(8, 6, 4, format))
            picture.set_pixels(oiio.ROI(), pixels)
            oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, picture, file)
        else:
            output = oiio.ImageOutput.create(file)
            output.open(file, oiio.ImageSpec(8, 6, channels, format))
            output.write_image(numpy.ascontiguousarray(pixels[:, :, :channels]))
            output.close()
        write("texture", kind, bytes([number]) + pathlib.Path(file).read_bytes())
        pathlib.Path(file).unlink()


def answers():
    """Of a decoder process (plugins/openimageio/sandbox/messages.h): two levels and five texts, and a refusal."""
    text = lambda t: struct.pack("<I", len(t)) + t
    level = lambda side: struct.pack("<13i", -1, 2, side, side, 0, 0, side, side, 16, 16, 4, 2, 1)
    spec = struct.pack("<I", 2) + level(64) + level(32) + b"".join(map(text, (b"sRGB", b"periodic,clamp", b"", b"mirror", b"Plain Texture"))) + struct.pack("<i", 8)
    for name, status, said in (("spec", 1, spec), ("refusal", 2, b"no \x1b[0m picture \xc3\xa4 \xff")):
        write("answer", name, struct.pack("<IIQQ", 1, status, 1, len(said)) + said)


def volumes():
    """A grid of numbers, a level set, one of colors."""
    import pyopenvdb

    ball = pyopenvdb.createLevelSetSphere(1.0, voxelSize=0.5)
    cloud, colors = pyopenvdb.FloatGrid(), pyopenvdb.Vec3SGrid()
    cloud.fill((0, 0, 0), (3, 4, 5), 0.5)
    cloud.fill((64, 0, 0), (127, 63, 63), 1.0)
    colors.fill((0, 0, 0), (2, 2, 2), (0.25, 0.5, 1.0))
    for name, grid in {"ball": ball, "cloud": cloud, "colors": colors}.items():
        grid.name = "density"
        file = here / "scratch.vdb"
        pyopenvdb.write(str(file), grid)
        write("volume", name, file.read_bytes())
        file.unlink()


def cages():
    """Bytes that subdivision_fuzz.cpp makes meshes of."""
    numbers = random.Random(1)
    for i in range(8):
        write("subdivision", str(i), numbers.randbytes(64 + 64 * i))


def main(program):
    scratch = here / "scratch.usda"
    scratch.write_text(scene)
    binary, picture = here / "scratch.usdc", here / "scratch.exr"
    run = lambda *arguments: subprocess.run([program, *map(str, arguments)], check=True)
    run("flatten", scratch, "-o", binary)
    run("render", scratch, "-o", picture, "--res", 2, 2, "--spp", 1, "--resumable", "-q")
    write("usdc", "ball.usdc", binary.read_bytes())
    write("usdz", "ball.usdz", stored_zip([(b"ball.usda", scene.encode()), (b"t.png", b"no picture")]))
    write("exr", "layers.exr", picture.read_bytes())
    write("layers", "sums", sums())
    write("report", "two", report() + b"\0" + report())
    write("tally", "one", tally())
    textures()
    answers()
    volumes()
    cages()
    for file in (scratch, binary, picture):
        file.unlink()


main(sys.argv[1])
