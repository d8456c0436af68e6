# SPDX-License-Identifier: Apache-2.0
"""A scene, a folder and a render that is to be disturbed: what the parts of ./dev faults share."""
import os
import pathlib
import re
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCUMENTED = {0, 1, 3, 4, 5}


class Workshop:
    """One scene, one folder: the command of a render, what an undisturbed one gives, and checks of what a disturbed one left."""

    def __init__(self, arguments, folder, scene):
        """Scene: a name in scenes/, or a path."""
        self.bin, self.folder, self.scene, self.quiet = arguments.bin, folder, scene, True
        self.failing_calls, self.failing_allocations = (arguments.build / f"tests/libvelatura_failing_{what}.so" for what in ("calls", "allocations"))
        self.output = folder / "out.exr"
        self.size = ["--res", "32", "24", "--spp", str(arguments.spp)]
        began = time.monotonic()
        self.finish()
        self.seconds = time.monotonic() - began
        self.expected = self.hash()
        self.output.unlink()

    def command(self, threads, more=()):
        scene = self.scene if isinstance(self.scene, pathlib.Path) else ROOT / "scenes" / f"{self.scene}.usda"
        return [str(self.bin / "velatura"), "render", str(scene), "-o", str(self.output), *self.size, "--resume", "--progress", "none",
                *(["-q"] if self.quiet else []), "--threads", str(threads), *more]

    def start(self, threads, more=(), environment=None):
        return subprocess.Popen(self.command(threads, more), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                                errors="replace", env=dict(os.environ, **(environment or {})))

    def start_endless(self, threads):
        size, self.size = self.size, [*self.size[:-1], "1000000000"]
        process = self.start(threads)
        self.size = size
        return process

    def run(self, threads=2, more=(), environment=None, setup=None):
        done = subprocess.run(self.command(threads, more), stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
                              env=dict(os.environ, TMPDIR=str(self.folder.parent), **(environment or {})), preexec_fn=setup)
        return done.returncode, done.stderr

    def expect_rescued(self, text, what):
        """What cannot be put in its place is whole in another one, where a message says so. Returns whether it does."""
        found = re.search(r"is in (\S+) instead", text)
        if not found:
            return False
        path = pathlib.Path(found.group(1))
        expect(self.hash(path) == self.expected, f"{what}: what was put elsewhere is another image: {self.hash(path)}")
        path.unlink()
        return True

    def finish(self, threads=2):
        code, text = self.run(threads)
        expect(code == 0, f"{self.scene}: a render that nothing disturbs ends with {code}: {text}")

    def hash(self, path=None):
        done = subprocess.run([self.bin / "velatura-comp", "info", "--hash", path or self.output], capture_output=True, text=True)
        found = re.search("[0-9a-f]{64}", done.stdout)
        return found.group() if done.returncode == 0 and found else f"unreadable: {done.stderr}"

    def expect_right_end(self, what):
        """Goes on from what is there, whatever it is, to the undisturbed image."""
        self.finish(3)
        expect(self.hash() == self.expected, f"{what}: another image")
        expect_no_parts(self.folder, what)

    def clear(self):
        for path in self.folder.iterdir():
            path.unlink()


class Broken(Exception):
    pass


def expect(condition, text):
    if not condition:
        raise Broken(text)


def expect_no_parts(folder, what):
    left = sorted(p.name for p in folder.iterdir() if p.name.startswith("."))
    expect(not left, f"{what}: left behind {left}")


def exit_code(status):
    return 128 - status if status < 0 else status
