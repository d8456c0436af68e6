#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs every test of a hard case and tells what was measured. Usage: ./dev hardcases [--size commit|nightly|release]
[--write] [--images] [--only H07…]

Tests whose suite begins with H01 to H53 write down what they measure (hard_case.h); cases.toml says what the cases are.
--write puts the table into docs/engineering/hard_cases.md, --images renders docs/engineering/hard_cases.jpg before (case_images.py). Fails when a test
fails, a bound is not kept, a case was not measured, a case that is said to fail does not, or an image is not as it should be.
"""
import argparse
import concurrent.futures
import datetime
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/engineering/hard_cases.md"
IMAGES = PAGE.with_suffix(".jpg")
CASES = [f"H{n:02}" for n in range(1, 54)]

PICTURES_TEXT = f"""![Hard cases beside what they must equal]({IMAGES.name})

Images of hard cases, each beside the image that it must equal; captions begin with the number of the case. `./dev hardcases --images`
renders them (`tests/hardcases/case_images.py`) and compares. Scenes that are moved by 1e8, scaled by 2^-20 or in another order,
closed shutters, lenses without a focus and NaN texels must give the same image to the bit; the relMSE of the others has a
bound. White balls must vanish in a white dome (H20), a lamp of 1e5 in a closed mesh must not leak (H13), and water that touches
its glass must look like water that overlaps it, while a gap is visible (H41).
"""


def filter_of(cases, left_out):
    """Of GoogleTest: suites that begin with a case, those with parameters as well."""
    wanted = ":".join(f"{c}*:*/{c}*" for c in cases)
    return wanted + ("-" + ":".join(left_out) if left_out else "")


def run_program(program, test_filter, size, folder):
    """What ran, what failed, what was measured, by one test program."""
    record, report = folder / f"{program.name}.jsonl", folder / f"{program.name}.json"
    environment = dict(os.environ, VELATURA_HARDCASES_SIZE=size, VELATURA_HARDCASES_RECORD=str(record))
    done = subprocess.run([program, f"--gtest_filter={test_filter}", f"--gtest_output=json:{report}", "--gtest_brief=1"],
                          env=environment, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, errors="replace")
    outcomes = {}
    if report.exists():
        for suite in json.loads(report.read_text())["testsuites"]:
            for test in suite["testsuite"]:
                state = "skipped" if test.get("result") == "SKIPPED" else "failed" if test.get("failures") else "passed"
                outcomes[f"{suite['name']}.{test['name']}"] = (state, float(test["time"].rstrip("s")))
    # A crash loses the report and what came after
    if done.returncode != 0 and all(state != "failed" for state, _ in outcomes.values()):
        outcomes[f"{program.name} (exit code {done.returncode})"] = ("failed", 0.0)
    lines = [json.loads(line) for line in record.read_text().splitlines()] if record.exists() else []
    return outcomes, lines, done.stdout if done.returncode != 0 else ""


def case_of(test):
    """H07 of H07HugeThinSlab.IsHit, and of Radii/H07HugeThinSlab.IsHit/2."""
    suite = test.split(".")[0].split("/")[-1]
    return suite[:3]


def number(x):
    if x is None:
        return "none"
    return f"{x:.3g}" if x != int(x) or abs(x) >= 1e6 else str(int(x))


def closeness(line):
    """How near a measurement is to its bound; beyond 1 it is not kept."""
    if not line["kept"]:
        return float("inf")
    if line["bound"] == 0:
        return 0.0
    return max(line["measured"], line["detectable"]) / line["bound"]


def judge(case, outcomes, lines, text):
    """Verdict of a case and why, if it is not "passed"."""
    mine = {test: state for test, (state, _) in outcomes.items() if case_of(test) == case}
    if text.get("not_applicable"):
        return ("not applicable", text["not_applicable"])
    if any(state == "failed" for state in mine.values()):
        return ("FAILED", ", ".join(t for t, s in mine.items() if s == "failed"))
    known = [line for line in lines if line["known"]]
    if any(not line["kept"] for line in lines if not line["known"]):
        return ("FAILED", "a bound is not kept")
    if text.get("fails"):
        return ("fails", text["fails"]) if known else ("FAILED", "said to fail, and nothing shows it")
    if known:
        return ("FAILED", "a known failure that cases.toml does not tell")
    if not lines:
        return ("FAILED", "nothing was measured" + (": skipped here" if "skipped" in mine.values() else ""))
    return ("passed", "")


def table_lines(lines):
    """The measurement nearest to its bound of each test, exact ones after those with a number."""
    of_test = {}
    for line in lines:
        suite, name = line["test"].split(".", 1)
        of_test.setdefault(f"{suite}.{name.split('/')[0]}", []).append(line)
    nearest = []
    for measured in of_test.values():
        line = dict(max(measured, key=closeness))
        if len(measured) > 1:
            line["what"] += f" (the nearest of {len(measured)})"
        nearest.append(line)
    return sorted(nearest, key=lambda line: -closeness(line))


def seen(line):
    if line["sees"]:
        return line["sees"]
    return number(line["detectable"]) if line["detectable"] else "exact"


def draw(programs):
    """Makes the sheet of images. Returns: whether they are as they should be."""
    print("images:", flush=True)
    command = [sys.executable, "-B", ROOT / "tests/hardcases/case_images.py", "--bin", programs, "-o", IMAGES]
    return subprocess.run(command, stdin=subprocess.DEVNULL).returncode == 0


def page(texts, verdicts, measured, size, seconds):
    """docs/engineering/hard_cases.md."""
    count = {v: sum(1 for verdict, _ in verdicts.values() if verdict == v) for v in ("passed", "fails", "not applicable")}
    total = sum(len(lines) for lines in measured.values())
    out = [f"""# Hard cases

Cases that break renderers: what goes wrong elsewhere, how Velatura avoids it, and the measured error. A test whose suite begins with the
number of the case measured each number; `./dev hardcases --size {size} --write` runs them and writes this page. A bound of 0 is equality to the
bit, or a count of failures. *Seen* is the smallest error that a test finds with a probability of 90 %, *exact* without
random numbers; a test whose noise exceeds its bound fails, unless the bound is a few standard errors itself (H44). Of the measurements of a test the one nearest to its bound is shown.

Size `{size}`, {datetime.date.today().isoformat()}: {total} measurements in {seconds:.0f} s of CPU time. {count['passed']} cases
passed, {count['fails']} fails in a known way, {count['not applicable']} do not apply. Statements about other renderers come from their sources
(pbrt-v4 5f7a606, Mitsuba 3 b45b0a9, Cycles 97dbe6f, MoonRay 7330447, Embree 93040c7) or in the issues named; nothing was run there.
Units, precision and error: [numerics.md](numerics.md).
"""]
    if IMAGES.exists():
        out.append(PICTURES_TEXT)
    for case in CASES:
        text, (verdict, reason) = texts[case], verdicts[case]
        out.append(f"## {case} {text['title']}\n")
        out.append(f"*Elsewhere:* {text['elsewhere']}\n")
        out.append(f"*Here:* {text['here']}\n")
        if reason:
            out.append(f"**{verdict[0].upper() + verdict[1:]}:** {reason}\n")
        if measured[case]:
            out.append("| measured | value | bound | seen | against |\n|---|---|---|---|---|")
            for line in table_lines(measured[case]):
                mark = "" if line["kept"] else " **not kept**"
                out.append(f"| {line['what'].replace('|', chr(92) + '|')} | {number(line['measured'])}{mark} | {number(line['bound'])} | {seen(line).replace('|', chr(92) + '|')} | {line['oracle']} |")
            out.append("")
    return "\n".join(out)


def main():
    parser = argparse.ArgumentParser(prog="./dev hardcases", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tests", type=pathlib.Path, default=ROOT / "build/release/tests", help=argparse.SUPPRESS)
    parser.add_argument("--size", choices=["commit", "nightly", "release"], default="commit")
    parser.add_argument("--only", nargs="+", choices=CASES, metavar="CASE", help="these cases alone")
    parser.add_argument("--write", action="store_true", help="put the table into docs/engineering/hard_cases.md")
    parser.add_argument("--images", "--pictures", dest="images", action="store_true", help="render docs/engineering/hard_cases.jpg")
    arguments = parser.parse_args()
    if arguments.write and arguments.only:
        parser.error("--write needs all cases")

    catalogue = tomllib.loads((ROOT / "tests/hardcases/cases.toml").read_text())
    texts = catalogue["case"]
    if sorted(texts) != CASES:
        sys.exit("cases.toml does not have the cases H01 to H53")
    left_out = catalogue["not_on_commit"] if arguments.size == "commit" else []
    test_filter = filter_of(arguments.only or CASES, left_out)

    programs = (arguments.tests / "hardcases.txt").read_text().split()
    begin = time.monotonic()
    outcomes, lines, failures = {}, [], []
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = [pool.submit(run_program, arguments.tests / name, test_filter, arguments.size, pathlib.Path(folder))
                for name in programs]
        for run in runs:
            ran, wrote, output = run.result()
            outcomes.update(ran)
            lines += wrote
            failures += [output] if output else []
    seconds = time.monotonic() - begin
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_seconds = usage.ru_utime + usage.ru_stime

    for output in failures:
        print(output)
    shown = arguments.only or CASES
    measured = {case: [line for line in lines if line["case"] == case] for case in CASES}
    verdicts = {case: judge(case, outcomes, measured[case], texts[case]) for case in CASES}
    for case in shown:
        verdict, reason = verdicts[case]
        print(f"{case}  {verdict:15} {texts[case]['title']}" + (f": {reason}" if reason else ""))
        for line in table_lines(measured[case]):
            print(f"       {number(line['measured']):>10} of {number(line['bound']):<8} {line['what']}  [{seen(line)}]")
    slow = sorted(outcomes.items(), key=lambda item: -item[1][1])[:5]
    print("slowest: " + ", ".join(f"{test} {time_s:.1f} s" for test, (_, time_s) in slow))
    bad = [case for case in shown if verdicts[case][0] == "FAILED"]
    bad += [test for test, (state, _) in outcomes.items() if state == "failed" and case_of(test) not in CASES]
    if arguments.images and not draw(arguments.tests.parent / "bin"):
        bad.append("images")
    print(f"{len(outcomes)} tests, {len(lines)} measurements, {seconds:.1f} s, {cpu_seconds:.1f} s of CPU time; " +
          (f"not as they should be: {', '.join(bad)}" if bad else "all as they should be"))
    if arguments.write:
        PAGE.write_text(page(texts, verdicts, measured, arguments.size, cpu_seconds))
        print(f"wrote {PAGE.relative_to(ROOT)}")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
