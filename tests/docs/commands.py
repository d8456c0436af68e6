#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the commands of README.md and of the guides, in the order of the page, and compares what they print.

Usage: commands.py BIN [--page NAME…] [--keep FOLDER] [--self-test]

BIN is the folder of the programs. A block fenced as ```sh is run, all blocks of a page in one folder that is empty but for a link to
scenes/. A block ```text right behind it holds lines of what it prints, in order; `…` stands for any text. A block ```sh not run: REASON is
listed and not run. A command in any other block is an error, so that none is forgotten.
"""
import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
TIMEOUT_S = 120
PROGRAMS = re.compile(r"\s*(?:\$ |(?:[\w./]*/)?(?:velatura|velatura-comp|velatura-comp-ui) [\w-]|\./dev\b|cmake |apt-get |sudo )")


@dataclasses.dataclass
class Block:
    line: int  # of the fence
    info: str
    text: list


def blocks(text):
    found, fence = [], ""
    previous_end, lines = 0, text.split("\n")
    for number, line in enumerate(lines, 1):
        mark = re.match(r"(```+)(.*)$", line)
        if mark and not fence:
            fence = mark[1]
            found.append(Block(number, mark[2].strip(), []))
        elif fence and line.strip() == fence:
            fence, previous_end = "", number
        elif fence:
            found[-1].text.append(line)
        elif re.match(r"    \S", line) and (number == 1 or not lines[number - 2].strip() or previous_end == number - 1):
            # Indented code
            found.append(Block(number, "", [line]))
    return found


def reason_not_to_run(block):
    words = re.match(r"sh not run: (.+)$", block.info)
    return words[1] if words else None


def faults_of_form(name, text):
    """Commands in blocks that are not run, and marks that mean nothing."""
    wrong = []
    for block in blocks(text):
        if re.match(r"sh\b", block.info):
            if block.info != "sh" and not reason_not_to_run(block):
                wrong.append(f"{name}:{block.line}: ```{block.info}: ```sh, or ```sh not run: REASON")
        else:
            wrong += [f"{name}:{block.line + 1 + i}: a command in a block that is not run: {line.strip()}"
                      for i, line in enumerate(block.text) if PROGRAMS.match(line)]
    return wrong


def missing_line(expected, printed):
    """The first line of `expected` that `printed` lacks, in order."""
    lines = iter(re.sub(r"[ \t]+", " ", line).strip() for line in printed.replace("\r", "\n").split("\n"))
    for line in expected:
        words = re.sub(r"[ \t]+", " ", line).strip()
        if not words or words == "…":
            continue
        pattern = re.compile(".*".join(re.escape(part) for part in re.split(r" ?… ?", words)))
        if not any(pattern.fullmatch(found) for found in lines):
            return line
    return None


def count_of_commands(lines):
    count, end = 0, None
    for i, line in enumerate(lines):
        if end is not None:
            end = None if line == end else end
        elif line.strip() and not line.startswith("#") and not (i and lines[i - 1].endswith("\\")):
            count += 1
            here = re.search(r"<<'(\w+)'", line)
            end = here[1] if here else None
    return count


def run_page(name, text, folder, programs):
    """(faults, number of commands, seconds, what was not run)"""
    wrong, count, start, skipped = faults_of_form(name, text), 0, time.monotonic(), []
    environment = dict(os.environ, PATH=f"{programs}{os.pathsep}{os.environ['PATH']}", LC_ALL="C.UTF-8", TERM="dumb")
    environment.pop("OCIO", None)
    printed = None
    for block in blocks(text):
        reason = reason_not_to_run(block)
        if reason:
            skipped.append(f"{name}:{block.line}: not run: {reason}")
        elif block.info == "sh":
            count += count_of_commands(block.text)
            try:
                done = subprocess.run(["bash", "-euo", "pipefail", "-c", "\n".join(block.text)], cwd=folder, env=environment, text=True,
                                      stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT_S)
            except subprocess.TimeoutExpired:
                return wrong + [f"{name}:{block.line}: takes more than {TIMEOUT_S} s"], count, time.monotonic() - start, skipped
            if done.returncode:
                # Those below need what this one writes
                return wrong + [f"{name}:{block.line}: exit code {done.returncode} of", *block.text, done.stdout], count, \
                    time.monotonic() - start, skipped
            printed = done.stdout
            continue
        elif block.info == "text" and printed is not None:
            line = missing_line(block.text, printed)
            if line is not None:
                wrong.append(f"{name}:{block.line}: not printed: {line}\nprinted:\n{printed}")
        printed = None
    return wrong, count, time.monotonic() - start, skipped


def self_test():
    page = ("```sh\necho one   two 3.2 s\ncat > file <<'END'\nfour\nEND\n```\n```text\none two … s\n```\n\n```sh\ntest \"$(cat file)\" = four\n```\n"
            "```sh not run: needs a moon\nfalse\n```\n")
    with tempfile.TemporaryDirectory() as folder:
        def faults(text):
            return run_page("page", text, folder, "/bin")[0]
        wrong, count, _, skipped = run_page("page", page, folder, "/bin")
        kinds = {"passes": not wrong and count == 3 and skipped == ["page:14: not run: needs a moon"],
                 "a command that fails": len(faults("```sh\nfalse\n```\n")) > 0,
                 "one that fails before another": len(faults("```sh\nfalse\ntrue\n```\n")) > 0,
                 "a line that is not printed": len(faults(page.replace("one two …", "two …"))) == 1,
                 "lines in another order": len(faults("```sh\nprintf 'a\\nb\\n'\n```\n```text\nb\na\n```\n")) == 1,
                 "a command that is not run": len(faults("```\nvelatura render x.usda\n```\n    velatura-comp info x.exr\n")) == 2,
                 "a mark without a reason": len(faults("```sh skip\ntrue\n```\n")) == 1}
    wrong = [kind for kind, is_right in kinds.items() if not is_right]
    if wrong:
        sys.exit("commands.py does not see: " + ", ".join(wrong))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", type=pathlib.Path, nargs="?")
    parser.add_argument("--page", nargs="*", help="only these, as README.md or docs/guide/light_mix.md")
    parser.add_argument("--keep", type=pathlib.Path, help="work in this folder, and leave what is written")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    pages = ["README.md", *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs/guide").glob("*.md"))]
    pages = [page for page in pages if not arguments.page or page in arguments.page]

    def run(page):
        with tempfile.TemporaryDirectory() as temporary:
            folder = (arguments.keep or pathlib.Path(temporary)) / pathlib.Path(page).stem
            folder.mkdir(parents=True, exist_ok=True)
            if not (folder / "scenes").exists():
                (folder / "scenes").symlink_to(ROOT / "scenes")
            return run_page(page, (ROOT / page).read_text(encoding="utf-8"), folder, arguments.programs.resolve())

    wrong = []
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for page, (faults, count, seconds, skipped) in zip(pages, pool.map(run, pages)):
            print(f"{page}: {count} commands, {seconds:.1f} s", *skipped, sep="\n", flush=True)
            wrong += faults
    sys.exit("\n".join(wrong) if wrong else 0)


if __name__ == "__main__":
    main()
