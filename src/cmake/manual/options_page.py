#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes docs/reference/options.md: every option of the programs, from what they print for --help-all.

Usage: options_page.py [--check] PAGE PROGRAM...
--check writes nothing: it exits with 1 and prints what differs if PAGE is not what the programs print.
"""
import argparse
import difflib
import pathlib
import re
import sys

import help_text

# Commands that share most of their options with another one, whose table they do not repeat
MODELS = {"velatura": "velatura render", "velatura-comp": "velatura-comp mix", "velatura-comp-ui": "velatura-comp ui"}


def code(text):
    return f"`{text}`" if text else ""


def cell(text):
    return text.replace("\\", "\\\\").replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*").strip()


def rows(options):
    lines = ["| option | value | default | meaning |", "|---|---|---|---|"]
    for option in options:
        names = ", ".join(code(name) for name in option.names)
        ranges = [fact for fact in option.facts if re.match(r"-?[0-9]", fact)]
        text = "; ".join([option.text] + [fact for fact in option.facts if fact not in ranges])
        value = ", ".join([option.value] + ranges)
        lines.append(f"| {names} | {cell(value)} | {cell(option.default)} | {cell(text)} |")
    return lines


def key(option):
    return (tuple(option.names), option.value, option.full_text)


def anchor(name):
    return re.sub(r"[^\w\- ]", "", name.lower()).replace(" ", "-")


def section(command, model):
    """A command; options that `model` has in the same words are named, and explained there."""
    lines = [f"## {command.name}", "", cell(command.summary.rstrip(".")) + ".", "", f"    {command.usage}", ""]
    if command.positionals:
        lines += ["| argument | meaning |", "|---|---|"]
        lines += [f"| {code(p.names[0])} | {cell(p.text)} |" for p in command.positionals] + [""]
    known = {key(o) for o in model.options} if model and model is not command else set()
    shared = [o for title, options in command.groups.items() if title != "Help" for o in options if key(o) in known]
    for title, options in command.groups.items():
        if title == "Help":
            continue
        own = [o for o in options if key(o) not in known]
        if own:
            lines += ([f"**{cell(title)}**", ""] if title != "Options" else []) + rows(own) + [""]
    if shared:
        names = ", ".join(code(max(o.names, key=len)) for o in shared)
        lines += [f"Also, as in [{model.name}](#{anchor(model.name)}): {names}.", ""]
    if command.examples:
        lines += ["Example:", ""] + [f"    {example}" for example in command.examples] + [""]
    if command.footer and not command.footer.startswith("Exit codes"):
        lines += [cell(command.footer), ""]
    return lines


def page(programs):
    lines = ["# Options", "",
             "Every option of every command, as `--help-all` prints it. This page is generated: `ninja -C build/release velatura_options_page`",
             "writes it, and a test compares it with the programs. What the options do together is in [rendering.md](rendering.md) and",
             "[mix.md](mix.md); exit codes are in [command_line.md](command_line.md#exit-codes).", "", "| command | what it does |", "|---|---|"]
    commands = []
    for program in programs:
        for command in program.subcommands or [program]:
            commands += [command, *command.subcommands]
    by_name = {c.name: c for c in commands}
    lines += [f"| [`{c.name}`](#{anchor(c.name)}) | {cell(c.summary.rstrip('.'))} |" for c in commands] + [""]
    lines += ["Every command takes `-h` and `--help`, which print the usual options, and `--help-all`, which prints all. Both programs take `--version`.", ""]
    for command in commands:
        lines += section(command, by_name.get(MODELS.get(command.name.split()[0])))
    return "\n".join(lines).rstrip() + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true")
    parser.add_argument("page", type=pathlib.Path)
    parser.add_argument("programs", nargs="+")
    arguments = parser.parse_args()
    missing = [path for path in arguments.programs if not pathlib.Path(path).exists()]
    if missing:
        # `./dev test app` builds no window
        print(f"SKIPPED: there is no {missing[0]}")
        return
    wanted = page([help_text.read_program(path) for path in arguments.programs])
    if not arguments.check:
        arguments.page.write_text(wanted, encoding="utf-8")
        return
    found = arguments.page.read_text(encoding="utf-8")
    if found != wanted:
        print(f"{arguments.page} is not what --help-all prints; ninja velatura_options_page writes it:")
        sys.exit("".join(difflib.unified_diff(found.splitlines(True), wanted.splitlines(True), "page", "--help-all", n=0)))
    names = set(re.findall(r"`(--[a-z][\w-]*)`", found))
    print(f"{arguments.page.name}: {len(names)} options, as --help-all has them")


if __name__ == "__main__":
    main()
