#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Hair, grass and dew of scenes/tuft as BasisCurves and Points.

Usage: generate.py FOLDER
"""
import math
import pathlib
import random
import sys

HAIRS, BLADES, DROPS = 20000, 9000, 400


def rows(values, digits=5):
    return ", ".join("(" + ", ".join(f"{x:.{digits}g}" for x in v) + ")" for v in values)


def on_ball(rng):
    while True:
        v = [rng.uniform(-1, 1) for _ in range(3)]
        length = math.sqrt(sum(x * x for x in v))
        if 0.05 < length < 1 and v[1] / length > -0.35:
            return [x / length for x in v]


def hair(rng):
    """Pinned B-splines of seven vertices that fall over a ball and taper to a tip."""
    points, widths, colors = [], [], []
    for _ in range(HAIRS):
        p = on_ball(rng)
        step = [0.09 * (x + rng.uniform(-0.3, 0.3)) for x in p]
        for k in range(7):
            points.append(list(p))
            widths.append(0.008 * (1 - 0.15 * k))
            step = [x + rng.uniform(-0.006, 0.006) for x in step]
            step[1] -= 0.012
            p = [a + b for a, b in zip(p, step)]
        shade = rng.uniform(0.5, 1)
        colors.append([0.8 * shade, 0.5 * shade, 0.22 * shade])
    return points, widths, colors


def grass(rng):
    """Cubic Bézier ribbons that face any side and bend over; and places for dew."""
    points, normals, colors, dew = [], [], [], []
    for _ in range(BLADES):
        r, turn, lean = 4.5 * math.sqrt(rng.random()), rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi)
        x, z, h = r * math.cos(turn), r * math.sin(turn), rng.uniform(0.15, 0.45)
        c, s, bend = math.cos(lean), math.sin(lean), rng.uniform(0.05, 0.3)
        for along, up in ((0, 0), (0, 0.4), (0.3, 0.8), (1, 1)):
            points.append([x + c * bend * along, up * h - 1, z + s * bend * along])
        normals.append([c, 0.4, s])
        shade = rng.uniform(0.5, 1)
        colors.append([0.2 * shade, 0.45 * shade, 0.1 * shade])
        if len(dew) < DROPS and rng.random() < 0.1:
            dew.append(points[-1])
    return points, normals, colors, dew


def main(folder):
    rng = random.Random(7)
    points, widths, colors = hair(rng)
    blades, normals, greens, dew = grass(rng)
    drops = ", ".join(f"{rng.uniform(0.01, 0.04):.3g}" for _ in dew)
    text = f"""#usda 1.0
(
    defaultPrim = "Strands"
    upAxis = "Y"
)

def Scope "Strands"
{{
    def BasisCurves "Hair" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        uniform token basis = "bspline"
        uniform token wrap = "pinned"
        int[] curveVertexCounts = [{", ".join(["7"] * HAIRS)}]
        point3f[] points = [{rows(points)}]
        float[] widths = [{", ".join(f"{w:.3g}" for w in widths)}] (interpolation = "vertex")
        color3f[] primvars:tone = [{rows(colors, 3)}] (interpolation = "uniform")
        rel material:binding = </Strands/Ginger>
    }}

    def Material "Ginger"
    {{
        token outputs:surface.connect = </Strands/Ginger/Fibre.outputs:surface>

        def Shader "Fibre"
        {{
            uniform token info:id = "VelaturaHair"
            color3f inputs:color.connect = </Strands/Ginger/Tone.outputs:result>
            float inputs:roughness = 0.25
            float inputs:azimuthalRoughness = 0.35
            token outputs:surface
        }}

        def Shader "Tone"
        {{
            uniform token info:id = "UsdPrimvarReader_float3"
            string inputs:varname = "tone"
            float3 outputs:result
        }}
    }}

    def BasisCurves "Grass"
    {{
        uniform token basis = "bezier"
        int[] curveVertexCounts = [{", ".join(["4"] * BLADES)}]
        point3f[] points = [{rows(blades)}]
        float[] widths = [{", ".join(["0.03, 0.003"] * BLADES)}] (interpolation = "varying")
        normal3f[] normals = [{rows(normals, 4)}] (interpolation = "uniform")
        color3f[] primvars:displayColor = [{rows(greens, 3)}] (interpolation = "uniform")
    }}

    def Points "Dew"
    {{
        point3f[] points = [{rows(dew)}]
        float[] widths = [{drops}]
        color3f[] primvars:displayColor = [(0.8, 0.85, 0.9)] (interpolation = "constant")
    }}
}}
"""
    (pathlib.Path(folder) / "strands.usda").write_text(text)


if __name__ == "__main__":
    main(sys.argv[1])
