# SPDX-License-Identifier: Apache-2.0
"""What the tests share. ctest sets PYTHONPATH to the module and VELATURA_BIN to the programs."""
import gc
import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]

SCENE = """#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Y"
)
def Xform "World"
{
    def Camera "Cam"
    {
        float focalLength = 20
        double3 xformOp:translate = (0, 1, 6)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Sphere "Ball"
    {
        double radius = 1
        color3f[] primvars:displayColor = [(0.8, 0.3, 0.2)]
        double3 xformOp:translate = (0, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Mesh "Floor"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-5, 0, 5), (5, 0, 5), (5, 0, -5), (-5, 0, -5)]
        uniform token subdivisionScheme = "none"
    }
    def SphereLight "Key"
    {
        float inputs:intensity = 30
        float inputs:intensity.timeSamples = { 1: 30, 11: 50 }
        double3 xformOp:translate = (2, 4, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def DomeLight "Sky"
    {
        float inputs:intensity = 0.3
    }
}
"""

# What makes renders of the tests take hundredths of a second
SMALL = {"res": (20, 12), "spp": 4, "bounces": 2, "guiding": "off"}


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "ball.usda"
    path.write_text(SCENE)
    return path


@pytest.fixture(autouse=True)
def no_stage_is_left():
    """What a test kept alive must not hold the settings of the process for the next one."""
    yield
    gc.collect()


def words_of(options):
    """Options of a render as words of the command."""
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif isinstance(value, tuple):
            words += [option, *map(str, value)]
        elif isinstance(value, list):
            words.append(f"{option}={','.join(map(str, value))}")
        else:
            words.append(f"{option}={value}")
    return words


@pytest.fixture
def command():
    """Runs a program: command("velatura", "render", ...)."""
    def run(program, *words, code=0):
        done = subprocess.run([os.path.join(os.environ["VELATURA_BIN"], program), *map(str, words)], capture_output=True,
                              encoding="utf-8")
        assert done.returncode == code, done.stderr
        return done.stdout
    return run
