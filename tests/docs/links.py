#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the links of every page (.md) of the project: the file exists, and the heading that #anchor names.

Usage: links.py [ROOT]. Prints `page:line: what is wrong` and exits with 1 if anything is. Links to other sites are not followed.
A page of docs/ that no other page links to is an error, too. --self-test checks pages that are planted for it.
"""
import pathlib
import re
import sys
import tempfile

import checks

FOLDERS = ("docs", "src", "compositor", "plugins", "tests", "scenes", "examples", ".github")
# [text](target) and ![text](target); the text may hold brackets of its own, as [`a[b]`](c)
LINK = re.compile(r"\]\(\s*<?([^()\s<>]+(?:\([^()\s]*\)[^()\s<>]*)*)>?(?:\s+\"[^\"]*\")?\s*\)")
# The start of docs/ in the reading order, which README.md links to
UNLINKED = ("docs/adr/",)


def without_code(text):
    """Blanks code, fenced or in backticks, so that lines keep their numbers."""
    fence, out = "", []
    for line in text.split("\n"):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark and not fence:
            fence = mark[1]
            out.append("")
        elif fence:
            if line.strip() == fence:
                fence = ""
            out.append("")
        else:
            out.append(line)
    return out


def anchors(text):
    """The anchors that GitHub gives to headings, and those of <a name> or <a id>."""
    found, seen = set(), {}
    for line in without_code(text):
        for name in re.findall(r"<a (?:name|id)=\"([^\"]+)\"", line):
            found.add(name)
        heading = re.match(r"#{1,6}\s+(.*?)\s*#*\s*$", line)
        if not heading:
            continue
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading[1])
        anchor = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
        count = seen.get(anchor, 0)
        seen[anchor] = count + 1
        found.add(anchor if count == 0 else f"{anchor}-{count}")
    return found


def pages(root):
    found = sorted(root.glob("*.md"))
    for folder in FOLDERS:
        found += sorted(p for p in (root / folder).rglob("*.md") if "generated" not in p.parts)
    return found


def check(root):
    wrong, linked = [], set()
    texts = {page.resolve(): page.read_text(encoding="utf-8") for page in pages(root)}
    for page, text in texts.items():
        name = page.relative_to(root)
        for number, line in enumerate(without_code(text), 1):
            # What stands in backticks is no link, but a link may have code as its text
            shown = re.sub(r"`[^`]*`", lambda m: "`" * len(m[0]), line)
            for match in LINK.finditer(shown):
                target, _, anchor = match[1].partition("#")
                if re.match(r"[a-z]+:", match[1]):
                    continue
                file = (page.parent / target).resolve() if target else page
                if not file.exists():
                    wrong.append(f"{name}:{number}: no file {target}")
                    continue
                if root not in file.parents and file != root:
                    wrong.append(f"{name}:{number}: {target} lies outside of the project")
                    continue
                if file != page:
                    linked.add(file)
                if anchor and file.suffix == ".md" and anchor not in anchors(texts.get(file) or file.read_text(encoding="utf-8")):
                    wrong.append(f"{name}:{number}: no heading #{anchor} in {file.relative_to(root)}")
    for page in texts:
        name = page.relative_to(root).as_posix()
        if name.startswith("docs/") and not name.startswith(UNLINKED) and page not in linked:
            wrong.append(f"{name}:1: no page links to it")
    return wrong, f"{len(texts)} pages: every link resolves"


def self_test():
    """Faults of every kind are found, and nothing else is."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder).resolve()
        (root / "docs").mkdir()
        (root / "README.md").write_text("# A\n[b](docs/b.md#two-words)\n```\n[not](a/link.md)\n```\n`[nor](this.md)` [`x[1]`](docs/b.md)\n"
                                        "[gone](docs/gone.md)\n[no heading](docs/b.md#three)\n[out](../x)\n[site](https://example.org/a.md)\n")
        (root / "docs/b.md").write_text("# B\n## Two *words*\n## Twice\n## Twice\n[a](#twice-1) [up](../README.md)\n")
        (root / "docs/alone.md").write_text("# Alone\n")
        wrong, done = check(root)
        expected = ["README.md:7: no file docs/gone.md", "README.md:8: no heading #three in docs/b.md", "README.md:9: no file ../x",
                    "docs/alone.md:1: no page links to it"]
        if wrong != expected or not done.startswith("3 pages"):
            sys.exit("\n".join(["links.py finds other faults than were planted:", *wrong]))


if __name__ == "__main__":
    checks.run(check, self_test)
