#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that docs/reference/messages.md has every code of the messages in the sources, and no other.

Usage: messages.py [ROOT]. A code is a kebab-case string where a message is made, or any kebab-case string of two words and more that is not
listed in OTHER_WORDS. --self-test checks planted sources.
"""
import re
import sys

import checks

# Kebab-case strings that are no codes: values of options, limits, features, ledger entries, reasons, programs
OTHER_WORDS = set("""
    adaptive-sampling arc-cycle arc-to-prohibited-child array-bytes blackman-harris blue-noise bounce-layers camera-blur capacity-exceeded
    caster-layers catmull-rom caustic-search caustic-trial-cap clamp-layers data-layers decode-memory decode-time deep-samples deformation-blur
    depth-of-field diffuse-transmission effect-left-out environment-maps f-stop gave-up global-area half-images id-mattes inconsistent-property-type
    interior-media lobe-matrix invalid-asset-path invalid-authored-relocation invalid-conflicting-relocation invalid-external-target-path
    invalid-instance-target-path invalid-prim-path invalid-reference-offset invalid-same-target-relocations invalid-sublayer-offset
    invalid-sublayer-ownership invalid-sublayer-path jobtemplate-2023-09 level-sets light-filters light-layers light-linking light-profiles light-selection
    light-shaping light-textures lobe-multipliers matrix-layers max-depth mesh-lights mitchell-ratio normal-maps
    opinion-at-relocation-source path-layers per-light image-side prims-per-spec ray-visibility rough-diffuse shadow-controls shadow-layers small-lights
    sublayer-cycle surface-emission target-error task-time tessellated-gprims texture-fallback thin-film throughput-cutoff too-far transform-blur unresolved-prim-path
    variable-expression varying-inputs velatura-comp velatura-comp-ui velatura-pictures velatura-texture velatura-view
""".split())
WORD = r"[a-z][a-z0-9]*(?:-[a-z0-9]+)*"
MADE = [re.compile(pattern) for pattern in (
    rf'(?:\.|->)(?:warn|error|note)\(\s*"({WORD})"', rf'\bError\{{\s*"({WORD})"', rf'\[({WORD})\](?:\\n)?"', rf'return \{{"({WORD})",',
    rf'"({WORD})", \{{\}}, \{{\}}')]
KEBAB = re.compile(r'"([a-z]+(?:-[a-z0-9]+)+)"')
# Strings that look like codes where no message is made: marks of the window, nodes, interfaces
NOT_MADE = {"inf", "instance", "mode", "picture", "rgba", "sheen", "stale", "textures", "wipe"}


def without_comments(text):
    return re.sub(r"//[^\n]*", "", text)


def codes_of(text):
    text = without_comments(text)
    found = {match[1] for pattern in MADE for match in pattern.finditer(text)} - NOT_MADE
    return found | {match[1] for match in KEBAB.finditer(text) if match[1] not in OTHER_WORDS}


def listed_codes(page):
    return {code for line in page.split("\n") if line.startswith("| `") for code in re.findall(r"`([^`]+)`", line.split("|")[1])}


def self_test():
    source = 'ctx.warn("bad-thing", p, "x"); // "old-code"\nreturn Error{\n"usage", ""};\nprint("error: [memory]\\n"); f("max-depth");\n'
    if codes_of(source) != {"bad-thing", "usage", "memory"}:
        sys.exit(f"messages.py finds {codes_of(source)}")
    if listed_codes("| code | meaning |\n|---|---|\n| `a`, `b-c` | `d` |\n") != {"a", "b-c"}:
        sys.exit("messages.py does not read the page")


def check(root):
    page = (root / "docs/reference/messages.md").read_text(encoding="utf-8")
    found = {}
    for folder in ("src", "compositor", "plugins"):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".cpp", ".h", ".inl"):
                for code in codes_of(file.read_text(encoding="utf-8")):
                    found.setdefault(code, file.relative_to(root))
    listed = listed_codes(page)
    wrong = [f"{found[code]}: messages.md does not have the code {code}" for code in sorted(set(found) - listed)]
    wrong += [f"docs/reference/messages.md: no message has the code {code}" for code in sorted(listed - set(found))]
    return wrong, f"messages.md: {len(listed)} codes, all of those in the sources"


if __name__ == "__main__":
    checks.run(check, self_test)
