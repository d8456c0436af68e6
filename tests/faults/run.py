#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Breaks renders on purpose and tells what is left of them. Usage: ./dev faults [--trials N] [--only PART…]

  kill      kill -9 at random instants, then --resume with other threads until done: the image of an undisturbed render
  signals   SIGINT, SIGTERM, SIGUSR1 at random instants, and to a render that has no end by itself; how soon a second one ends it
  calls     the n-th call of open, write, fsync, close, rename … fails, for n = 1 to the last call of the render
  reads     the same of calls that open, look at, map and read the files of the scene
  cut       a file of the scene is cut short while the render reads it
  allocations  the n-th allocation fails alone, or there is no more memory from it on
  readers   the output is read in a loop while checkpoints replace it: always a whole image
  places    a full disk, a read-only folder, a limit on the size of files
  damage    files cut short and with flipped bits: refused with exit code 5, or the image is right nevertheless
  lock      a second render to the same file is refused; temporary files of killed ones are swept
  memory    --memory-limit below and about what renders of 22 scenes take: none has 2 % more resident, and each ends as documented

N is that of kill (200); the others have N/2 of each signal, N damaged files, N cut ones, and N allocations of each of two scenes. Instants follow a fixed seed. Small
renders in a folder in memory, since what counts is the order of calls and not the speed of a disk.
"""
import argparse
import os
import pathlib
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

from allocations import HOW_MEMORY_FAILS, count_allocations, spread, try_allocation
from inputs import Reading, try_cut, try_read, try_readers
from workshop import DOCUMENTED, ROOT, Broken, Workshop, exit_code, expect, expect_no_parts

SCENES = ["cornell/cornell", "transport/glass", "transport/lens"]
MEMORY_SCENES = ["cornell/cornell", "atelier/atelier", "bonfire/bonfire", "sky/sky", "tuft/tuft",
                 *(f"transport/{name}" for name in ("baffle", "caustic", "doorway", "glass", "gloss", "glowing_mesh", "lamp_sizes", "lens", "linked", "many_lights",
                                                    "sheets", "sun", "wide_sun", "window"))]
# Made by others
ASSETS = pathlib.Path(os.environ.get("VELATURA_TEST_ASSETS", ROOT / "../shared/assets"))
MEMORY_ASSETS = ["usd-wg/full_assets/SubdivisionSurfaces/Creases_SpinningPyramids.usda", "usd-wg/full_assets/Teapot/Teapot.usd", "usd-wg/intent-vfx/scenes/teapotScene.usd"]
MEMORY_LIMITS = [0.35, 0.6, 0.8, 0.9, 1.0, 1.1, 1.3]  # of what a render without a limit takes
PARTS = ["kill", "signals", "calls", "reads", "cut", "allocations", "readers", "places", "damage", "lock", "memory"]
ERRORS = ["ENOSPC", "EIO", "EROFS", "EACCES", "EINTR", "short"]


def try_kill(shop, rng, trial):
    """Up to three kills, in the middle of checkpoints for the most part."""
    what = f"kill {trial} of {shop.scene}"
    kills = 0
    for threads in rng.sample([1, 2, 3, 4], rng.randint(1, 3)):
        process = shop.start(threads, ["--checkpoint", "0.001s"])
        try:
            process.wait(rng.uniform(0.0, 1.2) * shop.seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            kills += 1
        _, text = process.communicate()
        expect(process.returncode in (0, -9), f"{what}: ended with {process.returncode}: {text}")
    shop.expect_right_end(what)
    return kills


def handles(process, number):
    """Whether the program has come to handle the signal: before, the system ends it."""
    try:
        status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    except OSError:
        return False
    caught = re.search(r"SigCgt:\s*([0-9a-f]+)", status)
    return caught is not None and bool(int(caught.group(1), 16) >> (number - 1) & 1)


def try_signal(shop, rng, trial, number):
    what = f"{number.name} {trial} of {shop.scene}"
    process = shop.start(rng.randint(1, 3))
    while process.poll() is None and not handles(process, number):
        time.sleep(0.001)
    time.sleep(rng.uniform(0.0, 1.0) * shop.seconds)
    process.send_signal(number)
    seconds = 0.0
    if number != signal.SIGUSR1 and trial % 2:
        began = time.monotonic()
        process.send_signal(number)
        process.wait(20)
        seconds = time.monotonic() - began
    _, text = process.communicate()
    code = exit_code(process.returncode)
    allowed = {0} if number == signal.SIGUSR1 else {0, 128 + number}
    expect(code in allowed, f"{what}: exit code {code}: {text}")
    if shop.output.exists():
        expect(not shop.hash().startswith("unreadable"), f"{what}: the file cannot be read")
    expect(code != 0 or shop.output.exists(), f"{what}: exit code 0 and no file")
    shop.expect_right_end(what)
    return seconds


def try_endless(shop, number):
    """A render that ends by being asked to only: with the code and the image of the signal."""
    what = f"{number.name} to an endless render of {shop.scene}"
    shop.clear()
    process = shop.start_endless(2)
    try:
        while process.poll() is None and not handles(process, number):
            time.sleep(0.001)
        time.sleep(shop.seconds)
        process.send_signal(number)
        if number == signal.SIGUSR1:
            wait_until(shop.output.exists, f"{what}: no interim image")
            expect(process.poll() is None, f"{what}: ended with {process.returncode}")
        else:
            process.wait(60)
            expect(exit_code(process.returncode) == 128 + number, f"{what}: exit code {exit_code(process.returncode)}")
        expect(shop.output.exists(), f"{what}: no image")
        expect(not shop.hash().startswith("unreadable"), f"{what}: the file cannot be read")
    finally:
        process.kill()
        process.communicate()


def wait_until(condition, text):
    end = time.monotonic() + 60
    while not condition():
        expect(time.monotonic() < end, text)
        time.sleep(0.01)


def try_call(shop, old, n, how, always):
    """Returns: whether the render has an n-th call."""
    what = f"{how} at call {n}{' and later' if always else ''}"
    shop.clear()
    shop.output.write_bytes(old)
    with tempfile.NamedTemporaryFile() as log:
        environment = {"LD_PRELOAD": str(shop.failing_calls), "VELATURA_FAULT_FOLDER": str(shop.folder), "VELATURA_FAULT_AT": str(n), "VELATURA_FAULT_HOW": how,
                       "VELATURA_FAULT_LOG": log.name}
        code, text = shop.run(1, environment=environment | ({"VELATURA_FAULT_ALWAYS": "1"} if always else {}))
        failed = pathlib.Path(log.name).read_text().split("\n")[0]
    if not failed:
        expect(code == 0, f"{what}: nothing failed, and exit code {code}: {text}")
        return False
    what += f" ({failed})"
    expect(code in DOCUMENTED, f"{what}: exit code {code}: {text}")
    # Libraries open files once; nothing interrupts that but a network's file system
    if how in ("EINTR", "short") and not (how == "EINTR" and failed.startswith("open")):
        expect(code == 0, f"{what}: not tried again, exit code {code}: {text}")
    if code == 0:
        expect(shop.hash() == shop.expected, f"{what}: exit code 0 and another image")
    else:
        expect(str(shop.output) in text, f"{what}: the message does not name the file: {text}")
        # Behind the rename nothing can bring the old file back: then the new one is there, whole
        is_old = shop.output.exists() and shop.output.read_bytes() == old
        expect(is_old or shop.hash() == shop.expected, f"{what}: the old file is gone: {shop.hash()}")
        is_early = failed.startswith("open") or "checkpoint" in text
        is_rescued = shop.expect_rescued(text, what)
        expect(is_rescued or not is_old or is_early or code != 1, f"{what}: the image is lost: {text}")
    shop.expect_right_end(what)
    return True


def try_limit(shop, old):
    shop.clear()
    shop.output.write_bytes(old)
    code, text = shop.run(setup=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)))
    expect(code == 1 and str(shop.output) in text, f"limit on file sizes: exit code {code}: {text}")
    expect(shop.output.read_bytes() == old, "limit on file sizes: the old file is gone")
    shop.expect_right_end("limit on file sizes")


def try_mounted(shop, old, options, name):
    """A file system of its own. Returns: why it cannot be had, or nothing."""
    shop.clear()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", shop.folder], capture_output=True, text=True)
    if made.returncode:
        return made.stderr.strip()
    try:
        shop.output.write_bytes(old)
        if options:
            subprocess.run(["mount", "-o", options, shop.folder], check=True)
        else:
            free = os.statvfs(shop.folder)
            (shop.folder / "full").write_bytes(bytes(free.f_bavail * free.f_frsize - 8192))
        code, text = shop.run()
        expect(code == 1 and str(shop.output) in text, f"{name}: exit code {code}: {text}")
        expect(shop.output.read_bytes() == old, f"{name}: the old file is gone")
        expect_no_parts(shop.folder, name)
    finally:
        subprocess.run(["umount", shop.folder], check=True)
    return None


def try_damage(shop, rng, old, cut):
    what, bad = "cut", bytearray(old)
    shop.clear()
    if cut:
        what = f"cut after {cut} of {len(old)} bytes"
        bad = bad[:cut]
    else:
        at, bit = rng.randrange(len(old)), rng.randrange(8)
        what = f"bit {bit} of byte {at} flipped"
        bad[at] ^= 1 << bit
    shop.output.write_bytes(bad)
    code, text = shop.run()
    if code == 0 and not cut:
        # It hit what a render that goes on does not read
        expect(shop.hash() == shop.expected, f"{what}: another image")
        return False
    expect(code == 5 and str(shop.output) in text, f"{what}: exit code {code}: {text}")
    expect(shop.output.read_bytes() == bytes(bad), f"{what}: the file was changed")
    return True


def try_lock(shop, rng, trial):
    what = f"lock {trial}"
    shop.clear()
    first = shop.start_endless(1)
    try:
        while first.poll() is None and not (shop.folder / ".out.exr.lock").exists():
            time.sleep(0.001)
        time.sleep(rng.uniform(0.0, 0.5) * shop.seconds)
        code, text = shop.run()
        expect(code == 5 and f"process {first.pid} on" in text and str(shop.output) in text, f"{what}: exit code {code}: {text}")
    finally:
        first.kill()
        first.communicate()
    # What killed processes leave is no lock
    (shop.folder / ".out.tmp.Ab0xYz.exr").write_bytes(b"half an image")
    shop.expect_right_end(what)


def peak_of(command):
    """Exit code, messages, and what the process had resident at most, in bytes."""
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen([str(c) for c in command], stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        _, status, usage = os.wait4(process.pid, 0)
        output.seek(0)
        return os.waitstatus_to_exitcode(status), output.read(), usage.ru_maxrss * 1024


def try_memory(arguments, folder, scene, more, fractions):
    """Returns the largest part of its limit that a render took, and how many were rendered, stopped early and refused."""
    output = folder / "out.exr"
    command = [arguments.bin / "velatura", "render", scene, "-o", output, "--res", *arguments.memory_size, "--spp", "2",
               "--progress", "none", *more]
    what = " ".join([scene.stem, *more])
    code, text, free = peak_of(command)
    expect(code == 0, f"{what}: a render without a limit ends with {code}: {text}")
    ends, worst = {0: 0, 3: 0, 6: 0}, 0.0
    for fraction in fractions:
        for path in folder.iterdir():
            path.unlink()
        limit = fraction * free
        code, text, peak = peak_of([*command, "--memory-limit", f"{limit / 1e6:.3f}M"])
        case = f"{what} with {fraction} of {free / 1e6:.0f} MB"
        expect(code in ends, f"{case}: exit code {code}: {text}")
        expect(peak <= 1.02 * limit, f"{case}: {peak / 1e6:.1f} MB resident: {text}")
        expect(code == 0 or "memory-limit" in text, f"{case}: says nothing: {text}")
        expect(output.exists() == (code != 6), f"{case}: exit code {code}, file {output.exists()}: {text}")
        expect("texture-unreadable" not in text and "light-texture" not in text, f"{case}: another image: {text}")
        expect(not [p for p in folder.iterdir() if ".tmp." in p.name], f"{case}: left behind {sorted(folder.iterdir())}")
        ends[code] += 1
        worst = max(worst, peak / limit)
    return worst, ends


class Tally:
    def __init__(self):
        self.broken = []

    def trial(self, function, *arguments):
        try:
            return function(*arguments)
        except Broken as broken:
            self.broken.append(str(broken))
            print(f"NOT AS IT SHOULD BE: {broken}", flush=True)
            return None


def run_parts(arguments, shops, tally):
    rng = random.Random(9)
    n = arguments.trials

    def part(name, result):
        print(f"{name:8} {result}", flush=True)

    if "kill" in arguments.only:
        kills = 0
        for trial in range(n):
            shop = shops[trial % len(shops)]
            shop.clear()
            kills += tally.trial(try_kill, shop, rng, trial) or 0
        part("kill", f"{n} renders, {kills} kills")
    if "signals" in arguments.only:
        slowest = 0.0
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1):
            for shop in shops:
                tally.trial(try_endless, shop, number)
            for trial in range(max(2, n // 2)):
                shop = shops[trial % len(shops)]
                shop.clear()
                slowest = max(slowest, tally.trial(try_signal, shop, rng, trial, number) or 0.0)
        part("signals", f"{max(2, n // 2)} each of SIGINT, SIGTERM, SIGUSR1; the slowest end by a second signal took {slowest:.3f} s")
    shop = shops[0]
    shop.clear()
    whole_size = list(shop.size)
    shop.size[-1] = "2"
    shop.finish()
    shop.size = whole_size
    old = shop.output.read_bytes()
    if "calls" in arguments.only:
        count = 0
        for how in arguments.errors:
            for always in (False, True):
                call = 1
                while not (always and how in ("EINTR", "short")) and tally.trial(try_call, shop, old, call, how, always) is not False:
                    call += arguments.step
                    count += 1
        part("calls", f"{count} renders with failed calls")
    if "readers" in arguments.only:
        reads, seen = tally.trial(try_readers, shops[-1]) or (0, 0)
        part("readers", f"{reads} times read, {seen} different files")
    if "allocations" in arguments.only:
        run_allocations(arguments, shops[:2], rng, tally, part)
    if "places" in arguments.only:
        tally.trial(try_limit, shop, old)
        full = tally.trial(try_mounted, shop, old, "", "a full disk")
        read_only = tally.trial(try_mounted, shop, old, "remount,ro", "a read-only folder")
        part("places", f"limit on file sizes, full disk{f' SKIPPED ({full})' if full else ''}, read-only folder{f' SKIPPED ({read_only})' if read_only else ''}")
    if "lock" in arguments.only:
        for trial in range(max(1, n // 10)):
            tally.trial(try_lock, shop, rng, trial)
        part("lock", f"{max(1, n // 10)} second renders")
    if "damage" in arguments.only:
        refused = 0
        for trial in range(n):
            cut = rng.randrange(1, len(old)) if trial % 4 == 0 else 0
            refused += bool(tally.trial(try_damage, shop, rng, old, cut))
        part("damage", f"{n} files, {refused} refused")


def run_allocations(arguments, shops, rng, tally, part):
    for shop in shops:
        size, shop.size = shop.size, ["--res", "160", "120", "--spp", "2"]
        shop.clear()
        shop.finish()
        expected, shop.expected = shop.expected, shop.hash()
        # What is there must be a file to go on from, and not the one that is to be
        shop.size[-1] = "1"
        shop.clear()
        shop.finish()
        old = shop.output.read_bytes()
        shop.size[-1] = "2"
        total = tally.trial(count_allocations, shop, old)
        ends = {}
        for how in HOW_MEMORY_FAILS:
            for at in spread(rng, total or 1, arguments.trials // 2):
                code = tally.trial(try_allocation, shop, old, at, how)
                ends[code] = ends.get(code, 0) + 1
        shop.size, shop.expected = size, expected
        part("allocations", f"{shop.scene}: of {total} allocations {sum(ends.values())} failed, exit codes {', '.join(f'{code} x {n}' for code, n in sorted(ends.items(), key=str))}")


def run_inputs(arguments, folder, tally):
    reading, rng = Reading(arguments, folder), random.Random(9)
    if "reads" in arguments.only:
        count = 0
        for how in arguments.errors:
            call = 1
            while tally.trial(try_read, reading, call, how) is not False:
                call += arguments.step
                count += 1
        print(f"reads    {count} renders with calls that could not read", flush=True)
    if "cut" in arguments.only:
        ends = {}
        for trial in range(arguments.trials):
            code = tally.trial(try_cut, reading, rng, trial)
            ends[code] = ends.get(code, 0) + 1
        print(f"cut      {arguments.trials} files, exit codes {', '.join(f'{code} x {n}' for code, n in sorted(ends.items(), key=str))}", flush=True)


def run_memory(arguments, folder, tally):
    own = {name: ROOT / "scenes" / f"{name}.usda" for name in MEMORY_SCENES}
    scenes = [*own.values(), *(ASSETS / name for name in MEMORY_ASSETS)]
    cases = [(scene, [], MEMORY_LIMITS) for scene in scenes]
    cases += [(own["cornell/cornell"], ["--resumable"], MEMORY_LIMITS), (own["transport/lens"], ["--float-layers", "--mode", "tile"], MEMORY_LIMITS)]
    # What the threads of libraries do where memory ends is a matter of luck
    rng = random.Random(20261125)
    cases += [(own[f"transport/{name}"], [], [rng.uniform(0.5, 1.0) for _ in range(arguments.trials // 4)]) for name in ("doorway", "gloss")]
    worst, ends, left_out = 0.0, {0: 0, 3: 0, 6: 0}, []
    for scene, more, fractions in cases:
        if (scene.parent / "generate.py").exists() and not (scene.parent / "generated" / "complete").exists():
            left_out.append(f"{scene.stem} (scenes/make.py was not run)")
            continue
        if not scene.exists():
            left_out.append(f"{scene.stem} (not in VELATURA_TEST_ASSETS)")
            continue
        found = tally.trial(try_memory, arguments, folder, scene, more, fractions)
        if found is None:
            continue
        worst = max(worst, found[0])
        ends = {code: count + found[1][code] for code, count in ends.items()}
    print(f"memory   {len({scene for scene, _, _ in cases}) - len(left_out)} scenes, {sum(ends.values())} renders with limits: {ends[0]} whole, {ends[3]} stopped with what they had, {ends[6]} refused; "
          f"at most {100 * worst:.1f} % of the limit resident" + (f"; SKIPPED: {', '.join(left_out)}" if left_out else ""), flush=True)


def main():
    parser = argparse.ArgumentParser(prog="./dev faults", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release", help=argparse.SUPPRESS)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, metavar="PART")
    parser.add_argument("--errors", nargs="+", choices=ERRORS, default=ERRORS, metavar="ERROR", help="how calls fail")
    parser.add_argument("--step", type=int, default=1, help="every n-th of the calls alone")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--memory-size", nargs=2, default=["320", "240"], metavar=("W", "H"), help="pixels of the renders of memory")
    arguments = parser.parse_args()
    arguments.bin, arguments.scenes = arguments.build / "bin", ROOT / "scenes"
    began, tally = time.monotonic(), Tally()
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as folder:
        shops = []
        for i, scene in enumerate(SCENES):
            own = pathlib.Path(folder).resolve() / str(i)
            own.mkdir()
            shops.append(Workshop(arguments, own, scene))
        run_parts(arguments, shops, tally)
        if {"reads", "cut"} & set(arguments.only):
            own = pathlib.Path(folder).resolve() / "reading"
            own.mkdir()
            run_inputs(arguments, own, tally)
        if "memory" in arguments.only:
            own = pathlib.Path(folder).resolve() / "memory"
            own.mkdir()
            run_memory(arguments, own, tally)
    print(f"{time.monotonic() - began:.0f} s; " + (f"{len(tally.broken)} not as they should be" if tally.broken else "all as they should be"))
    sys.exit(1 if tally.broken else 0)


if __name__ == "__main__":
    main()
