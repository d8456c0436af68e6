#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a farm job costs, against one process.

Usage: measure.py BIN overhead [SCENE] [--pieces 2,8,32] [--at-most SHARE] [render options]
       measure.py BIN merge PART… [--at-most FACTOR]
       measure.py BIN target [SCENE[@ERROR]…] [--target 3%] [--at-most SHARE] [render options]

BIN is the folder of the programs.
overhead: CPU seconds of a local job of 2, 8 and 32 pieces, merge and previews included, against one render; the image must be the same. Where
          machines change their speed from minute to minute, "beside samples" says more: what is no sample, as a share of what is.
merge:    seconds and peak memory of a merge of all parts, against reading them (velatura-comp info --hash of each).
target:   jobs that stop at an error, against one process with the same --target-error: error, samples, CPU seconds.
--at-most makes it a test: a larger share beside samples, a slower merge, or an error farther from the target is a failure (exit code 1).
"""
import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
CORNELL = str(ROOT / "scenes/cornell/cornell.usda")


def run(words):
    """Returns: wall seconds, CPU seconds with all children, peak MB of the largest process, what it printed."""
    begin, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    process = subprocess.Popen([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    text = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.monotonic() - start
    if status:
        sys.exit(f"{' '.join(str(w) for w in words)}\n{text}")
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime
    return wall, max(cpu, usage.ru_utime + usage.ru_stime), usage.ru_maxrss / 1024, text


def pixels(programs, file):
    return run([programs / "velatura-comp", "info", "--hash", file])[3].split()[0]


def status(programs, job):
    return json.loads(run([programs / "velatura", "farm", "status", job, "--json"])[3])


def beside_samples(job, cpu):
    """CPU seconds of a job that are not those of samples, over those that are."""
    threads = os.cpu_count()
    attempts = [json.loads(piece.read_text())["attempts"][-1] for piece in (job / "pieces").glob("*.json")]
    samples = sum(a["trace_s"] * threads for a in attempts)
    return cpu / samples - 1, (cpu - samples) / len(attempts)


def overhead(programs, arguments, options):
    scene = arguments.words[0] if arguments.words else CORNELL
    worst = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        one = folder / "one.exr"
        wall, single, _, _ = run([programs / "velatura", "render", scene, "-o", one, "--progress", "none", *options])
        print(f"one process: {single:.2f} CPU s, {wall:.1f} s", flush=True)
        for count in map(int, arguments.pieces.split(",")):
            output = folder / f"{count}.exr"
            wall, cpu, _, _ = run([programs / "velatura", "farm", "submit", scene, "-o", output, "--pieces", count, "-q", *options])
            rendered = status(programs, folder / f"{count}.farm")["cpu_s"]
            if pixels(programs, output) != pixels(programs, one):
                sys.exit(f"{count} pieces: another image")
            share = cpu / single - 1
            other, of_a_piece = beside_samples(folder / f"{count}.farm", cpu)
            worst = max(worst, other)
            print(f"{count:3} pieces: {cpu:.2f} CPU s ({100 * share:+.1f} %), of which renders {rendered:.2f} ({100 * (rendered / single - 1):+.1f} %); "
                  f"beside samples {100 * other:.2f} %, {of_a_piece:.3f} CPU s per piece; {wall:.1f} s", flush=True)
    return worst


def merge(programs, arguments, options):
    parts = arguments.words
    with tempfile.TemporaryDirectory(dir=pathlib.Path(parts[0]).parent) as temporary:
        reads = [run([programs / "velatura-comp", "info", "--hash", part]) for part in parts]
        reading, reading_cpu = sum(r[0] for r in reads), sum(r[1] for r in reads)
        print(f"reading {len(parts)} parts: {reading:.1f} s, {reading_cpu:.1f} CPU s, peak {max(r[2] for r in reads):.0f} MB", flush=True)
        output = pathlib.Path(temporary) / "merged.exr"
        wall, cpu, peak, _ = run([programs / "velatura-comp", "merge", *parts, "-o", output, *options])
        print(f"merge of {len(parts)} parts: {wall:.1f} s, {cpu:.1f} CPU s, peak {peak:.0f} MB; {wall / reading:.2f} times reading", flush=True)
        wall_of_result, _, peak_of_result, _ = run([programs / "velatura-comp", "info", "--hash", output])
        print(f"reading the result: {wall_of_result:.1f} s, peak {peak_of_result:.0f} MB")
    return wall / reading


def target(programs, arguments, options):
    worst = 0
    with tempfile.TemporaryDirectory() as temporary:
        for i, word in enumerate(arguments.words or [CORNELL]):
            scene, _, own = word.partition("@")
            wanted = own or arguments.target
            goal = float(wanted.rstrip("%")) / 100
            folder = pathlib.Path(temporary)
            one, stats, output = folder / f"one{i}.exr", folder / "one.json", folder / f"job{i}.exr"
            _, single, _, _ = run([programs / "velatura", "render", scene, "-o", one, "--progress", "none", "-q", "--stats", stats,
                                   "--target-error", wanted, *options])
            of_one = json.loads(stats.read_text())
            _, cpu, _, text = run([programs / "velatura", "farm", "submit", scene, "-o", output, "--target-error", wanted, "--piece-time",
                                     arguments.piece_time, *options])
            row = status(programs, folder / f"job{i}.farm")["outputs"][0]
            share = row["error"] / goal - 1
            worst = max(worst, abs(share))
            print(f"{pathlib.Path(scene).name}: target {100 * goal:.3g} %; job {100 * row['error']:.3f} % ({100 * share:+.1f} %) at {row['spp']} spp, {cpu:.1f} CPU s, "
                  f"{text.count('another round')} rounds more; one process {100 * of_one['error']['mean']:.3f} % at {of_one['samples']['ranges'][-1][-1]} spp, "
                  f"{single:.1f} CPU s; {cpu / single:.2f} times", flush=True)
    return worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("what", choices=("overhead", "merge", "target"))
    parser.add_argument("words", nargs="*")
    parser.add_argument("--pieces", default="2,8,32")
    parser.add_argument("--target", default="3%")
    parser.add_argument("--piece-time", default="10m")
    parser.add_argument("--at-most", type=float)
    arguments, options = parser.parse_known_args()
    figure = {"overhead": overhead, "merge": merge, "target": target}[arguments.what](arguments.programs.resolve(), arguments, options)
    if arguments.at_most is not None and figure > arguments.at_most:
        sys.exit(f"expected at most {arguments.at_most}, found {figure:.3f}")


if __name__ == "__main__":
    main()
