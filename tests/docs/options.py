#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that every option that the user's pages name is in docs/reference/options.md, which another test compares with --help.

Usage: options.py [ROOT]. Looks at code (`--spp`, blocks) of README.md, docs/guide and docs/reference. Lines about other programs do not
count. --self-test checks a planted option.
"""
import re
import sys

import checks

PAGES = ("README.md", "docs/README.md", "docs/guide/*.md", "docs/reference/*.md")
OTHER_PROGRAMS = re.compile(r"\./dev\b|\bcmake\b|\bctest\b|\bapt-get\b|\bblender\b|\boiiotool\b|\bninja\b|\bpbrt\b|\bvalgrind\b|\busdview\b|\b(?:sbatch|srun)\b")
# Of pbrt, and a misspelt one
NOT_OURS = {"--cropwindow", "--nthreads", "--ssp"}
OPTION = re.compile(r"(?<![\w-])--[a-z][a-zA-Z0-9]*(?:-[a-z0-9]+)*")
# Options of other renderers that work as they are typed
FOREIGN = "src/app/foreign_options.cpp"


def options_in(line, in_block):
    code = line if in_block else " ".join(re.findall(r"`([^`]*)`", line))
    return [] if OTHER_PROGRAMS.search(line) else OPTION.findall(code)


def unknown(text, known):
    """(line, option) of options that are not known."""
    found, in_block = [], False
    for number, line in enumerate(text.split("\n"), 1):
        if re.match(r"\s*```", line):
            in_block = not in_block
            continue
        found += [(number, option) for option in options_in(line, in_block or line.startswith("    ")) if option not in known]
    return found


def self_test():
    text = "`--spp`, `--ssp N`, --plain\n```sh\nvelatura render a.usda --resolution 3\ncmake --preset release\n```\n    x --spp --sqq\n"
    if unknown(text, {"--spp"}) != [(1, "--ssp"), (3, "--resolution"), (6, "--sqq")]:
        sys.exit(f"options.py finds other faults than were planted: {unknown(text, {'--spp'})}")


def check(root):
    foreign = set(OPTION.findall((root / FOREIGN).read_text(encoding="utf-8")))
    known = NOT_OURS | foreign | set(OPTION.findall((root / "docs/reference/options.md").read_text(encoding="utf-8")))
    pages = sorted(page for pattern in PAGES for page in root.glob(pattern))
    wrong = [f"{page.relative_to(root)}:{line}: no program has the option {option}"
             for page in pages for line, option in unknown(page.read_text(encoding="utf-8"), known)]
    return wrong, f"{len(pages)} pages: every option that they name exists"


if __name__ == "__main__":
    checks.run(check, self_test)
