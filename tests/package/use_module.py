# SPDX-License-Identifier: Apache-2.0
"""Renders with the installed Python module what the installed program renders, and compares the files."""
import subprocess
import sys

import velatura

SCENE = "cornell/cornell.usda"
OPTIONS = {"res": (64, 48), "spp": 4}


def main():
    frame = velatura.render(SCENE, **OPTIONS)
    frame.write("module.exr")
    subprocess.run(["velatura", "render", SCENE, "--res", "64", "48", "--spp", "4", "--progress", "none",
                    "-o", "program.exr"], check=True, stderr=subprocess.DEVNULL)
    with open("module.exr", "rb") as a, open("program.exr", "rb") as b:
        return 0 if a.read() == b.read() and frame.layers["b1"].shape == (48, 64, 3) else 1


sys.exit(main())
