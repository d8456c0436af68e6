#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the tests for an effect cost scenes that do not call for it: instructions of plain renders by the usual program and
by builds that lack the effect (src/scene/effect_build.h). Usage: ./dev bench without [EFFECT… | all]

EFFECT: a name as `velatura plan` prints it, or several with + between. Without any: each effect that something per path
tests for, those that share their tests together, and all at once; "all" alone is only the last. Builds go one after the
other into build/without, where a change of effect compiles the files that test for it and no others.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/without"

# What a plain scene is not to pay, in percent: for one effect, and for all
MOST_EACH, MOST_ALL = 1.0, 3.0

# Effects that one test asks for together; those of NEVER_ALONE have no other
SHARED = ["camera-blur+transform-blur+deformation-blur", "instancing+quadrics+curves+points", "absorption+nested-bodies",
          "surface-emission+mesh-lights", "varying-inputs+textures+patterns", "light-linking+shadow-controls",
          "light-shaping+light-profiles"]
NEVER_ALONE = {"transform-blur", "quadrics", "curves", "points", "absorption"}

# Nothing that a plain scene does not call for: estimators and layers are effects as well
OPTIONS = ("--threads 1 --res 32 32 --spp 16 --mode tile --adaptive off --guiding off --splitting off --roulette none --max-depth 6 "
           "--layers none --lights off --progress none -q").split()

# Over scenes/cornell, whose surfaces are the displayColor of its prims: the same with a material of its own on all
SURFACES = """#usda 1.0
( subLayers = [@{cornell}@] )
over "World" ( prepend apiSchemas = ["MaterialBindingAPI"] )
{{
    rel material:binding = </World/Plain>
    def Material "Plain"
    {{
        token outputs:surface.connect = </World/Plain/Surface.outputs:surface>
        def Shader "Surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.6, 0.5, 0.4)
            float inputs:roughness = 0.4
            token outputs:surface
        }}
    }}
}}
"""


def effect_names():
    """Enumerators by their names on the command line."""
    text = (ROOT / "src/scene/effect.cpp").read_text()
    return {name: enumerator for enumerator, name in re.findall(r'\{Effect::(\w+), \w+, "([a-z-]+)"', text)}


def tested_effects():
    """Enumerators that something asks is_built() for."""
    found = set()
    for path in [*ROOT.glob("src/**/*.cpp"), *ROOT.glob("src/**/*.h")]:
        found.update(re.findall(r"is_built\((?:scene::)?Effect::(\w+)\)", path.read_text()))
    return found


def build(enumerators):
    """The program without these effects."""
    configure = ["cmake", "--preset", "without", f"-DVELATURA_WITHOUT_EFFECTS={';'.join(enumerators)}"]
    for command in (configure, ["cmake", "--build", str(BUILD), "--target", "velatura", "--parallel", str(os.cpu_count())]):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}\n{done.stdout}\n{done.stderr}")


def instructions(scene):
    """Of the render proper; a word instead where the scene calls for what the build lacks."""
    output = scene.parent / f"{scene.stem}.exr" if scene.is_relative_to(BUILD) else BUILD / f"{scene.stem}.exr"
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=velatura::integrator::run_schedule*",
               f"--callgrind-out-file={output.with_suffix('.callgrind')}", str(BUILD / "bin/velatura"), "render", str(scene), "-o", str(output), *OPTIONS]
    done = subprocess.run(command, capture_output=True, text=True)
    if "[effect-not-built]" in done.stderr:
        return "called for"
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or not found:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return int(found.group(1))


def count(scenes):
    with concurrent.futures.ThreadPoolExecutor() as pool:
        return list(pool.map(instructions, scenes))


def told(whole, lacking):
    return lacking if isinstance(lacking, str) else f"{lacking:,} {100.0 * (whole / lacking - 1.0):+.2f} %"


def main():
    parser = argparse.ArgumentParser(description="instructions that plain scenes spend on effects that they do not call for")
    parser.add_argument("effects", nargs="*", help="names, several with + between; or all")
    arguments = parser.parse_args()
    names, tested = effect_names(), tested_effects()
    every = [name for name, enumerator in names.items() if enumerator in tested]
    choices = arguments.effects or [*(name for name in every if name not in NEVER_ALONE), *SHARED, "all"]
    unknown = {name for choice in choices if choice != "all" for name in choice.split("+")} - set(every)
    if unknown:
        sys.exit(f"no test per path asks for {', '.join(sorted(unknown))}; those are {', '.join(every)}")

    cornell = ROOT / "scenes/cornell/cornell.usda"
    BUILD.mkdir(parents=True, exist_ok=True)
    surfaces = BUILD / "surfaces.usda"
    surfaces.write_text(SURFACES.format(cornell=cornell))
    scenes = [cornell, surfaces]
    build([])
    whole = count(scenes)
    print(f"Instructions of the render proper at 32x32 pixels, 16 spp, one thread: {whole[0]:,} of cornell, {whole[1]:,} with a material (surfaces).")
    print("Of builds without the effect, and what more the usual one spends:\n")
    print(f"{'without':<46} {'cornell':>26} {'surfaces':>26}", flush=True)
    worst = {}
    for choice in choices:
        parts = choice.split("+")
        if choice == "all":
            # What the scenes do call for stays
            parts = [name for name in every if name != "varying-inputs"]
        build([names[part] for part in parts])
        counted = count(scenes)
        print(f"{choice:<46} {told(whole[0], counted[0]):>26} {told(whole[1], counted[1]):>26}", flush=True)
        worst[choice] = max((100.0 * (w / c - 1.0) for w, c in zip(whole, counted) if not isinstance(c, str)), default=0.0)
    above = [c for c, percent in worst.items() if percent > (MOST_ALL if c == "all" else MOST_EACH)]
    if above:
        sys.exit(f"above {MOST_EACH} % each or {MOST_ALL} % in all: {', '.join(above)}")


if __name__ == "__main__":
    main()
