#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes what the scenes generate (meshes, textures, skies) where it is missing or older than its script.

Usage: scenes/make.py [SCENE…]      default: every scene that has a generate.py
"""
import pathlib
import subprocess
import sys

# Of a script that said what it does without
LEFT_OUT = 77

here = pathlib.Path(__file__).resolve().parent


def make(scene):
    script = here / scene / "generate.py"
    if not script.exists():
        if not (here / scene).is_dir():
            sys.exit(f"make.py: no scene {scene}")
        return
    stamp = here / scene / "generated" / "complete"
    sources = [script, *(here / "tools").glob("*.py")]
    if stamp.exists() and stamp.stat().st_mtime > max(s.stat().st_mtime for s in sources):
        return
    print(f"generating meshes and textures of scenes/{scene}", flush=True)
    stamp.parent.mkdir(exist_ok=True)
    stamp.unlink(missing_ok=True)
    result = subprocess.run([sys.executable, "-B", str(script), str(stamp.parent)], cwd=here)
    if result.returncode == LEFT_OUT:
        return
    result.check_returncode()
    stamp.touch()


if __name__ == "__main__":
    for name in sys.argv[1:] or sorted(p.parent.name for p in here.glob("*/generate.py")):
        make(name)
