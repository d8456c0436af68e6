#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Jobs of many frames and many pieces: what it takes to submit and to show them.

Usage: scale_test.py BIN

BIN is the folder of the programs. A job of 1,000 frames is written for each engine, without starting it; a job of 10,000 pieces, of which
each has a state, is shown in less than a second. Times are the fastest of three, in CPU seconds and wall seconds.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
CORNELL = str(ROOT / "scenes/cornell/cornell.usda")


def run(*words):
    """Returns: wall seconds, CPU seconds, what it printed."""
    start = time.monotonic()
    process = subprocess.Popen([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(str(w) for w in words)}\n{text}")
    return time.monotonic() - start, usage.ru_utime + usage.ru_stime, text


def expect(condition, text):
    if not condition:
        sys.exit(f"expected: {text}")


def size_of(folder):
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def submit(velatura, folder, name, *options):
    job = folder / f"{name}.farm"
    return run(velatura, "farm", "submit", CORNELL, "-o", folder / f"{name}.####.exr", "--job", job, *options), job


def thousand_frames(velatura, folder):
    for engine in ("local", "slurm", "openjd", "opencue"):
        # Of the last two, what submit writes is what a person hands to the engine
        start = ["--dry-run"] if engine in ("local", "slurm") else []
        (wall, cpu, _), job = submit(velatura, folder, engine, "--engine", engine, "--frames", "1-1000", "--pieces", "1", *start)
        size = size_of(job)
        print(f"1,000 frames, {engine}: {wall:.3f} s, {cpu:.3f} CPU s, {size / 1024:.0f} KB", flush=True)
        pieces = json.loads((job / "job.json").read_text())["pieces"]
        expect(len(pieces) == 1000, "1,000 pieces")
        expect(cpu < 1 and size < 1 << 20, "less than a CPU second and a megabyte")


def ten_thousand_pieces(velatura, folder):
    for name, frames, ranges in (("ranges", "1-100", 100), ("frames", "1-10000", 1)):
        _, job = submit(velatura, folder, name, "--frames", frames, "--spp", "1024", "--pieces", str(ranges), "--dry-run")
        attempt = {"node": "n", "host": "n", "process": 1, "start_s": time.time() - 1000, "wall_s": 600.5, "cpu_s": 1200.25, "trace_s": 590.0,
                   "peak_bytes": 1 << 30, "code": 0, "log": "logs/x.log"}
        part = {"bytes": 3, "sha256": "0" * 64, "scene": "0" * 16, "settings": "0" * 16}
        for i in range(10000):
            state = "done" if i % 3 else "failed"
            piece = {"schema": "velatura.farm.piece/1", "state": state, "failures": 0, "percent": 100.0, "attempts": [attempt] * (1 + i % 2)}
            if state == "done":
                piece["part"] = part
            (job / f"pieces/{i:04}.json").write_text(json.dumps(piece, indent=1))
        times = [run(velatura, "farm", "status", job, *words) for words in ([], [], [], ["--json"])]
        fastest = min(times[:3])
        print(f"status of 10,000 pieces, {name}: {fastest[0]:.3f} s, {fastest[1]:.3f} CPU s; --json {times[3][0]:.3f} s, {times[3][1]:.3f} CPU s",
              flush=True)
        expect("6666 of 10000 pieces done" in fastest[2], "the counts")
        expect(json.loads(times[3][2])["pieces"]["done"] == 6666, "the counts as JSON")
        expect(min(t[1] for t in times) < 1, "less than a CPU second")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    velatura = pathlib.Path(sys.argv[1]).resolve() / "velatura"
    with tempfile.TemporaryDirectory() as temporary:
        thousand_frames(velatura, pathlib.Path(temporary))
        ten_thousand_pieces(velatura, pathlib.Path(temporary))


if __name__ == "__main__":
    main()
