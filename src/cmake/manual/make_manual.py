#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes man pages and shell completions of programs, from what they print for --help. The pages are compressed as Debian's policy
asks (gzip -9n), so that equal pages are equal files.

Usage: make_manual.py --version VERSION --output SHARE PROGRAM...
"""
import argparse
import gzip
import pathlib
import shutil

import completion
import help_text
import man_page


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--version", required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder; emptied first")
    parser.add_argument("programs", nargs="+")
    arguments = parser.parse_args()
    shutil.rmtree(arguments.output, ignore_errors=True)
    for path in arguments.programs:
        program = help_text.read_program(path)
        pages = {f"man/man1/{man_page.page_name(command)}.1.gz": man_page.man_page(command, arguments.version, program)
                 for command in [program, *program.subcommands]}
        for name, text in (pages | completion.files(program)).items():
            file = arguments.output / name
            file.parent.mkdir(parents=True, exist_ok=True)
            content = text.encode("utf-8")
            file.write_bytes(gzip.compress(content, 9, mtime=0) if file.suffix == ".gz" else content)


if __name__ == "__main__":
    main()
