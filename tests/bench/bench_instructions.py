#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Instructions per path, against the stored ones of the same compiler and flags. Usage: ./dev bench instructions [--write]

plain, surfaces: a scene that calls for nothing, with estimators and layers off: the price of the tests for effects that
are off. The others: scenes with the defaults. Counted by callgrind on one thread, of the render proper; --write stores
what was counted in tests/bench/instructions.json. Fails above +0.5 %.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/release"
STORED = ROOT / "tests/bench/instructions.json"
MOST = 0.5  # percent

COMMON = "--threads 1 --res 32 32 --mode tile --adaptive off --progress none -q".split()
# Nothing that a plain scene does not call for: estimators and layers are effects as well
PLAIN = "--spp 16 --guiding off --splitting off --roulette none --max-depth 6 --layers none --lights off".split()
DEFAULTS = "--spp 8".split()

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


def build_flags():
    """Compiler, and how one hot file is compiled; paths left out."""
    compiler = subprocess.run(["c++", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    for command in json.loads((BUILD / "compile_commands.json").read_text()):
        if command["file"].endswith("/src/integrator/path_tracer.cpp"):
            words = command["command"].split()
            return {"compiler": compiler, "flags": " ".join(w for w in words if re.match(r"-(O|m|f|std|g|D(?!VELATURA_VERSION))", w))}
    sys.exit("build/release has no src/integrator/path_tracer.cpp: ./dev build")


def count(scene, options, folder):
    output = folder / f"{scene.stem}.exr"
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=velatura::integrator::run_schedule*",
               f"--callgrind-out-file={output.with_suffix('.callgrind')}", str(BUILD / "bin/velatura"), "render", str(scene), "-o", str(output),
               *COMMON, *options]
    done = subprocess.run(command, capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or not found:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    paths = 32 * 32 * int(options[options.index("--spp") + 1])
    return int(found.group(1)) / paths


def main():
    parser = argparse.ArgumentParser(description="instructions per path of the render proper")
    parser.add_argument("--write", action="store_true", help="store them")
    arguments = parser.parse_args()
    flags = build_flags()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        cornell = ROOT / "scenes/cornell/cornell.usda"
        surfaces = folder / "surfaces.usda"
        surfaces.write_text(SURFACES.format(cornell=cornell))
        runs = {"plain": (cornell, PLAIN), "surfaces": (surfaces, PLAIN)}
        for scene in ("cornell", "glass", "many_lights", "atelier"):
            runs[scene] = (next((ROOT / "scenes").glob(f"**/{scene}.usda")), DEFAULTS)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            # Each in a folder of its own: two of them share a scene
            folders = {run: folder / run for run in runs}
            for path in folders.values():
                path.mkdir()
            counted = dict(zip(runs, pool.map(lambda run: count(*runs[run], folders[run]), runs)))
    stored = json.loads(STORED.read_text()) if STORED.exists() else {}
    is_comparable = {key: stored.get(key) for key in flags} == flags
    print(f"{'scene':<12} {'instructions per path':>22} {'stored':>12}")
    above = []
    for run, value in counted.items():
        before = stored.get("per_path", {}).get(run) if is_comparable else None
        percent = 100.0 * (value / before - 1.0) if before else 0.0
        print(f"{run:<12} {value:>22,.0f} {f'{percent:+.2f} %' if before else '-':>12}")
        if percent > MOST:
            above.append(run)
    if arguments.write:
        STORED.write_text(json.dumps({**flags, "per_path": {run: round(value) for run, value in counted.items()}}, indent=2) + "\n")
    elif not is_comparable:
        print(f"\nstored ones are of another build: {stored.get('compiler', 'none')} {stored.get('flags', '')}; --write stores these")
    elif above:
        sys.exit(f"above +{MOST} %: {', '.join(above)}")


if __name__ == "__main__":
    main()
