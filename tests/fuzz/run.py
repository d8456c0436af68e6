#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What ./dev fuzz does once its programs are built.

  run FORMAT…           each libFuzzer program for so many --seconds of CPU time, its children's included, from
                        tests/fuzz/{seeds,regressions,corpus} and build/fuzz/corpus on
  keep FORMAT…          of build/fuzz/corpus and tests/fuzz/corpus the files that reach code which the others do not, as
                        tests/fuzz/corpus/FORMAT.zip: what later runs begin with, and the tests replay
  coverage FORMAT…      which lines of the readers all of these reach, by the replaying tests built for it
"""
import argparse
import hashlib
import io
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = ROOT / "tests/fuzz"
FOUND, GROWN = ROOT / "build/fuzz/found", ROOT / "build/fuzz/corpus"
MOST_BYTES = 1 << 16  # of an input
MOST_KEPT = 1 << 13  # of an input that is kept: larger ones are rarely needed, and stay in the history for ever

# Of whom the lines count: what reads the format, and not what writes it or what comes after
READERS = {
    "usda": ["src/usd/text/[^/]*(parser|list_edit|schema|scanner|number_text|spline_text)[^/]*"],
    "usdc": ["src/usd/crate/(arrays|coding|crate_file|field_reader|field_rules|item_reader|path_table|reader|scalar_reader|spline_bytes|time_samples|value_reader)[.]cpp"],
    "usdz": ["src/usd/package/", "src/base/zip_archive"],
    "mtlx": ["src/usd/materialx/"],
    "plugin": ["src/plugin/manifest"],
    "preset": ["compositor/look/look[.]cpp", "compositor/look/controls"],
    "topup": ["src/layers/top_up"],
    "layers": ["src/(layers|accumulate)/(layer_header|layer_set|sums_part|stored_counts)"],
    "exr": ["src/image/exr[.]cpp", "src/image/exr_header", "src/base/exr_headers", "src/layers/deep_file", "src/layers/strip_reader"],
    "lpe": ["src/film/light_path_expression", "src/film/path_automaton"],
    "report": ["src/study/compare"],
    "tally": ["src/study/tally_file"],
    "ies": ["src/translate/lights/ies_file"],
    "gltf": ["src/import/gltf"],
    "answer": ["plugins/openimageio/sandbox/messages"],
}


def formats():
    return re.findall(r"^add_format\((\w+) ", (HERE / "CMakeLists.txt").read_text(), re.MULTILINE)


def unpack(format, folder):
    """The kept files of a format, as files of a folder."""
    archive = HERE / f"corpus/{format}.zip"
    if archive.exists():
        with zipfile.ZipFile(archive) as kept:
            kept.extractall(folder)


def begin_with(format, kept):
    unpack(format, kept)
    folders = [HERE / kind / format for kind in ("seeds", "regressions")] + [kept]
    return [f for f in folders if f.is_dir()]


def program(format):
    return ROOT / f"build/fuzz/bin/velatura_fuzz_{format}"


def sanitizer_environment():
    """Leaks are looked for; memory that was given back is not kept back for long. OpenImageIO 2.4 deletes its own TextureSystem
    through a smaller type."""
    return dict(os.environ, ASAN_OPTIONS="detect_leaks=1:quarantine_size_mb=16:new_delete_type_mismatch=0",
                LSAN_OPTIONS=f"suppressions={HERE}/leaks.txt:print_suppressions=0")


def cpu_seconds(process):
    """Of a process and of its children that have ended, so far."""
    try:
        fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return sum(int(ticks) for ticks in fields[11:15]) / os.sysconf("SC_CLK_TCK")


def end_after(process, seconds):
    """Asks it to end when it has had its time, and makes it end when it does not. Returns its status and what it used."""
    asked = None
    while True:
        ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        if ended:
            return status, usage
        if asked is None and cpu_seconds(process) >= seconds:
            process.send_signal(signal.SIGUSR1)
            asked = time.monotonic()
        elif asked is not None and time.monotonic() - asked > 120:
            process.kill()
        time.sleep(0.5)


def run_format(format, seconds):
    """Returns whether nothing was found."""
    corpus, log = GROWN / format, FOUND / f"{format}.log"
    corpus.mkdir(parents=True, exist_ok=True)
    options = [f"-dict={HERE}/{format}.dict"] if (HERE / f"{format}.dict").exists() else []
    print(f"{format} for {seconds} s of CPU time", flush=True)
    with tempfile.TemporaryDirectory() as kept, open(log, "w") as output:
        # What takes more than a second is kept as a find of its own: on a busy machine it may be nobody's fault
        command = [program(format), "-timeout=20", "-report_slow_units=1", "-rss_limit_mb=512", f"-max_len={MOST_BYTES}",
                   "-print_final_stats=1", f"-artifact_prefix={FOUND}/{format}-", *options, corpus, *begin_with(format, pathlib.Path(kept))]
        process = subprocess.Popen([str(c) for c in command], stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=sanitizer_environment())
        status, usage = end_after(process, seconds)
    text = log.read_text(errors="replace")
    reached = re.findall(r"^#\d+\t\w+ +(cov: \d+ ft: \d+ corp: \S+)", text, re.MULTILINE)
    executions = re.findall(r"number_of_executed_units: *(\d+)", text)
    print(f"  {executions[-1] if executions else '?'} executions, {usage.ru_utime + usage.ru_stime:.0f} s of CPU time, {reached[-1] if reached else 'nothing reached'}", flush=True)
    if status != 0:
        print("\n".join(text.splitlines()[-40:]))
    return status == 0


def pack(format, files):
    """Stored, in the order of names and without dates: the same files are the same bytes."""
    bytes_ = io.BytesIO()
    with zipfile.ZipFile(bytes_, "w", zipfile.ZIP_STORED) as archive:
        for content in sorted(files):
            archive.writestr(zipfile.ZipInfo(hashlib.sha1(content).hexdigest()[:16]), content)
    archive = HERE / f"corpus/{format}.zip"
    archive.parent.mkdir(exist_ok=True)
    archive.write_bytes(bytes_.getvalue())
    print(f"{format}: {len(files)} files, {archive.stat().st_size} bytes")


def keep(format):
    with tempfile.TemporaryDirectory() as folder:
        old, least = pathlib.Path(folder) / "old", pathlib.Path(folder) / "least"
        old.mkdir()
        least.mkdir()
        begin = begin_with(format, old)
        # Seeds first: what they reach needs no file of its own. How often code is reached does not count
        command = [program(format), "-merge=1", "-use_counters=0", f"-max_len={MOST_KEPT}", "-timeout=20", "-rss_limit_mb=512", least, *begin, GROWN / format]
        done = subprocess.run([str(c) for c in command if c == least or not isinstance(c, pathlib.Path) or c.exists()], stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, errors="replace", env=sanitizer_environment())
        if done.returncode != 0:
            sys.exit(f"{format}: cannot be merged:\n{done.stderr[-3000:]}")
        seeds = {p.read_bytes() for f in begin if f != old for p in f.iterdir()}
        pack(format, {p.read_bytes() for p in least.iterdir()} - seeds)


def coverage(names):
    tests = ROOT / "build/coverage/tests/velatura_test_fuzz"
    with tempfile.TemporaryDirectory() as folder:
        for format in names:
            raw, merged = pathlib.Path(folder) / f"{format}.profraw", pathlib.Path(folder) / f"{format}.profdata"
            environment = dict(os.environ, LLVM_PROFILE_FILE=str(raw), VELATURA_FUZZ_CORPUS=str(GROWN), VELATURA_FUZZ_MUTANTS="1000")
            subprocess.run([tests, f"--gtest_filter=*/{format}", "--gtest_brief=1"], cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, check=True)
            subprocess.run(["llvm-profdata-14", "merge", "-sparse", raw, "-o", merged], check=True)
            exported = subprocess.run(["llvm-cov-14", "export", "-summary-only", f"-instr-profile={merged}", tests], capture_output=True, text=True, check=True).stdout
            print_coverage(format, json.loads(exported)["data"][0]["files"])


def print_coverage(format, files):
    patterns = [re.compile(f"{re.escape(str(ROOT))}/{p}") for p in READERS.get(format, [])]
    mine = [f for f in files if any(p.match(f["filename"]) for p in patterns)]
    if not mine:
        print(f"{format}: its lines are those of a library, of a plugin that is opened at run time or of a process of its own")
        return
    total, covered = (sum(f["summary"]["lines"][k] for f in mine) for k in ("count", "covered"))
    print(f"{format}: {100 * covered / total:.1f} % of {total} lines")
    for f in sorted(mine, key=lambda f: f["summary"]["lines"]["percent"]):
        lines = f["summary"]["lines"]
        print(f"  {lines['percent']:5.1f} % of {lines['count']:5} {pathlib.Path(f['filename']).relative_to(ROOT)}")


def main():
    parser = argparse.ArgumentParser(prog="./dev fuzz", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["run", "keep", "coverage"])
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("formats", nargs="*", choices=[*formats(), []], metavar="FORMAT")
    arguments = parser.parse_args()
    names = arguments.formats or formats()
    FOUND.mkdir(parents=True, exist_ok=True)
    if arguments.what == "run":
        good = [run_format(format, arguments.seconds) for format in names]
        sys.exit(0 if all(good) else f"something was found: {FOUND.relative_to(ROOT)}")
    if arguments.what == "keep":
        for format in names:
            keep(format)
    else:
        coverage(names)


if __name__ == "__main__":
    main()
