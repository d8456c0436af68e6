#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the advice of `velatura study` is good: studies scenes, follows the first row of each report, and measures what
that does to the error at equal render time, by other seeds and against an image of many samples.

Usage: ./dev bench study [SCENE…] [--starts default,plain] [--time SECONDS]

SCENE: as scenes/SCENE.usda or scenes/SCENE/SCENE.usda; without any, ten of them. Each is studied from three starts: the
options that a render has by itself; a plain path tracer; and a poor choice of estimators, where there is most to advise. "error" is what a render with the
advice leaves over what one without it leaves, as many samples taken as fit into the same CPU time, preparation included;
reading the scene is not. The check fails where advice raises it by more than 2 %.
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import pathlib
import subprocess
import sys
import threading

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = ROOT / "build/release/bin"
OUT = ROOT / "build/study"

SCENES = ("atelier bonfire cornell sky tuft transport/many_lights transport/lamp_sizes transport/glass transport/gloss "
          "transport/window").split()
PLAIN = "--sampler independent --adaptive off --splitting off --max-depth 8"
STARTS = {"poor": f"{PLAIN} --light-sampling area --light-selection uniform --roulette constant", "plain": PLAIN, "default": ""}

# What must not be: an error raised beyond this
MOST = 1.02
SPP = 16
SEEDS = range(101, 109)
REFERENCE_SEED, REFERENCE_TIMES = 900, 64
# Exit code of a study that had no time for two rounds, and advises nothing
TOO_SHORT = 3
LOCKS = collections.defaultdict(threading.Lock)
# Nothing left out, and no samples placed by what the pixels show
EXACT = "--max-depth 0 --adaptive off --integrator path --roulette throughput --dicing-rate 0.5"


def file_of(scene):
    for name in (f"{scene}.usda", f"{scene}/{scene}.usda"):
        if (ROOT / "scenes" / name).exists():
            return ROOT / "scenes" / name
    sys.exit(f"no scene {scene}")


def size_of(scene):
    """Width and height: small, of the image's shape."""
    return ("96", "96") if scene in ("cornell",) else ("128", "72")


def merged(*texts):
    """Options, the later ones in the place of earlier ones."""
    chosen = {}
    for text in texts:
        words = text.split()
        chosen.update(zip(words[::2], words[1::2]))
    return [word for pair in chosen.items() for word in pair]


class Subject:
    """One scene and the options it starts from."""

    def __init__(self, scene, start):
        self.scene, self.start = scene, start
        self.folder = OUT / scene.replace("/", "_") / start
        self.folder.mkdir(parents=True, exist_ok=True)

    def command(self, verb, output, options):
        return [str(BIN / "velatura"), verb, str(file_of(self.scene)), "-o", str(output), "--res", *size_of(self.scene),
                "--threads", "1", "--progress", "none", "-q", *options]

    def render(self, advice, seed, spp, name="image"):
        """Writes an image; returns CPU seconds of preparation and of samples."""
        image, stats = self.folder / f"{name}.exr", self.folder / f"{name}.json"
        options = merged(STARTS[self.start], advice, f"--seed {seed} --spp {spp} --layers none --lights off --stats {stats}")
        process = subprocess.Popen([*self.command("render", image, options), "--float-layers"], stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        if status != 0:
            sys.exit(f"{' '.join(self.command('render', image, options))}: status {status}")
        phases = json.loads(stats.read_text())["phases_s"]
        samples = phases["render"]
        return max(usage.ru_utime + usage.ru_stime - phases["open"] - phases["sync"] - samples, 0.0), samples

    def error_of(self, name="image"):
        """Root of relMSE against the reference."""
        done = subprocess.run([str(BIN / "velatura-comp"), "diff", "--json", str(self.folder / f"{name}.exr"), str(self.reference())],
                              capture_output=True, text=True)
        return math.sqrt(json.loads(done.stdout)["worstRelMse"])

    def reference(self):
        return OUT / self.scene.replace("/", "_") / "reference.exr"

    def make_reference(self):
        with LOCKS[self.scene]:
            if self.reference().exists():
                return
            options = merged(EXACT, f"--seed {REFERENCE_SEED} --spp {SPP * REFERENCE_TIMES} --layers none --lights off")
            subprocess.run([*self.command("render", self.reference(), options), "--float-layers"], check=True)

    def study(self, seconds, knobs):
        """Options that the first row of the report advises; empty: it advises none."""
        options = merged(STARTS[self.start], f"--spp {SPP} --time {seconds}s --rounds 32" + (f" --knobs {knobs}" if knobs else ""))
        command = self.command("study", self.folder, options)
        done = subprocess.run(command)
        if done.returncode not in (0, TOO_SHORT):
            sys.exit(f"{' '.join(command)}: status {done.returncode}")
        report = json.loads((self.folder / "report.json").read_text())
        return report["rows"][0]["options"], report

    def measure(self, advice):
        """Error with the advice over that without, at equal time, and the logarithm's standard error."""
        # Samples for the same time: by the least of some renders each, in turn
        times = {text: [] for text in ("", advice)}
        for seed in SEEDS[:3]:
            for text, taken in times.items():
                taken.append(self.render(text, seed, SPP))
        prepare, samples = ({text: min(t[part] for t in taken) for text, taken in times.items()} for part in (0, 1))
        left = prepare[""] + samples[""] - prepare[advice]
        spp = max(1, round(SPP * left / samples[advice]))
        logs, squares = [], {"": 0.0, advice: 0.0}
        for seed in SEEDS:
            errors = {}
            for text, n in (("", SPP), (advice, spp)):
                self.render(text, seed, n)
                errors[text] = self.error_of()
                squares[text] += errors[text] ** 2
            logs.append(math.log(errors[advice] / errors[""]))
        mean = sum(logs) / len(logs)
        spread = math.sqrt(sum((v - mean) ** 2 for v in logs) / (len(logs) - 1) / len(logs))
        return math.sqrt(squares[advice] / squares[""]), spread, spp


def follow(scene, start, seconds, knobs):
    """Studies one scene and measures what the advice does to the error: that, the start, and a line of the table."""
    subject = Subject(scene, start)
    advice, report = subject.study(seconds, knobs)
    if not advice:
        return 1.0, start, f"{scene:<26} {start:<8} none: {report['rows'][0]['verdict']}"
    subject.make_reference()
    ratio, spread, spp = subject.measure(advice)
    promised = next(s["error_ratio_at_equal_time"] for s in report["settings"] if s["options"] == advice)
    text = "{value:.3f} [{low:.3f}, {high:.3f}]".format(**promised)
    return ratio, start, f"{scene:<26} {start:<8} {advice:<28} {text:>22} {ratio:>8.3f} {1.96 * spread * ratio:>6.3f} {spp:>5}"


def main():
    parser = argparse.ArgumentParser(description="whether the advice of velatura study is good")
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--starts", default=",".join(STARTS), help="of " + ", ".join(STARTS))
    parser.add_argument("--time", type=int, default=90, help="seconds of each study")
    parser.add_argument("--knobs", default="", help="of velatura study: only these")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="scenes at a time, a thread for each")
    arguments = parser.parse_args()
    starts = arguments.starts.split(",")
    print(f"Studies of {arguments.time} s at {SPP} spp; error at equal time with the first row's advice over that without, {len(SEEDS)} other seeds\n")
    print(f"{'scene':<26} {'start':<8} {'advice':<28} {'promised':>22} {'error':>8} {'±':>6} {'spp':>5}", flush=True)
    tally = {start: [0, 0, 0] for start in starts}
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for ratio, start, text in pool.map(lambda choice: follow(*choice, arguments.time, arguments.knobs), [(scene, start) for start in starts for scene in arguments.scenes]):
            tally[start][0 if ratio < 1 else 1 if ratio <= MOST else 2] += 1
            print(text, flush=True)
    for start, (lower, same, higher) in tally.items():
        print(f"\n{start}: lower on {lower} of {lower + same + higher} scenes, nothing advised or within 2 % on {same}, higher on {higher}")
    if any(counts[2] for counts in tally.values()):
        sys.exit("advice raised the error")


if __name__ == "__main__":
    main()
