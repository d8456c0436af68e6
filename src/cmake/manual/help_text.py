# SPDX-License-Identifier: Apache-2.0
"""Reads what a program prints for --help-all into commands, options and their values: the source of man pages and completions."""
import dataclasses
import os
import re
import subprocess

# Texts of a section start in this column (help_page.cpp), on the line of the names or below it
TEXT_COLUMN = 30


@dataclasses.dataclass
class Option:
    names: list
    value: str  # placeholder for the value, empty for a switch
    text: str = ""
    default: str = ""
    facts: list = dataclasses.field(default_factory=list)  # "1 to 64", "repeatable", "needs --stats"

    @property
    def choices(self):
        listed = re.search(r"\{([^{}]+)\}", self.value)
        return listed[1].split(",") if listed else []

    @property
    def is_number(self):
        return self.value in ("N", "X")

    @property
    def is_repeatable(self):
        return "repeatable" in self.facts

    @property
    def full_text(self):
        facts = ([f"default: {self.default}"] if self.default else []) + self.facts
        return f"{self.text} [{'; '.join(facts)}]" if facts else self.text


@dataclasses.dataclass
class Command:
    name: str  # "velatura", or "velatura render"
    summary: str = ""
    usage: str = ""
    footer: str = ""
    examples: list = dataclasses.field(default_factory=list)  # command lines
    positionals: list = dataclasses.field(default_factory=list)  # Option with one name
    groups: dict = dataclasses.field(default_factory=dict)  # title: options
    subcommands: list = dataclasses.field(default_factory=list)  # Command

    @property
    def options(self):
        return [o for group in self.groups.values() for o in group]


def parse_option(head, text):
    """`-o, --output FILE` and `Text [default: X; repeatable]`."""
    words = head.split()
    names = [word.rstrip(",") for word in words if word.startswith("-")] or words[:1]
    value = " ".join(words[len(names):])
    facts = re.search(r"\s*\[((?:default: |required|repeatable|needs |not with |-?[0-9.e+-]+ (?:to|or more)).*)\]$", text)
    listed = facts[1].split("; ") if facts else []
    default = next((fact.removeprefix("default: ") for fact in listed if fact.startswith("default: ")), "")
    return Option(names, value, text[:facts.start()] if facts else text, default,
                  [fact for fact in listed if not fact.startswith("default: ")])


def entries(lines):
    """(head, text) of each entry: text in its column, or on the lines below."""
    found = []
    for line in lines:
        if line.startswith(" " * TEXT_COLUMN) and found:
            found[-1][1] = f"{found[-1][1]} {line.strip()}".strip()
        elif line[TEXT_COLUMN - 2:TEXT_COLUMN] == "  " and len(line) > TEXT_COLUMN:
            found.append([line[:TEXT_COLUMN].strip(), line[TEXT_COLUMN:].strip()])
        else:
            found.append([line.strip(), ""])
    return found


def parse(name, text):
    command = Command(name)
    sections = [("", [])]
    for line in text.splitlines():
        heading = re.match(r"([A-Z][^:]*):\s*$", line)
        if heading:
            sections.append((heading[1], []))
        elif line.strip() and not line.startswith(" ") and sections[-1][0]:
            # Text at the left margin ends a section
            sections.append(("", [line]))
        elif line.strip():
            sections[-1][1].append(line)
    before, after = sections[0][1], [line for title, lines in sections[1:] if not title for line in lines]
    command.footer = " ".join(line.strip() for line in after)
    for line in before:
        if line.startswith("Usage:"):
            command.usage = line.partition(":")[2].strip()
        else:
            command.summary = f"{command.summary} {line.strip()}".strip()
    for title, lines in sections[1:]:
        if title == "Arguments":
            command.positionals += [parse_option(head, text) for head, text in entries(lines)]
        elif title == "Commands":
            command.subcommands += [Command(f"{name} {head}", text) for head, text in entries(lines)]
        elif title == "Example":
            command.examples += [line.strip() for line in lines]
        elif title:
            command.groups[title] = [parse_option(head, text) for head, text in entries(lines)]
    return command


def help_of(program, *arguments):
    # Sanitizers look for leaks at the end of a process, which is not what is asked here
    environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=0", LC_ALL="C.UTF-8")
    # By its name alone, which stands in the usage line
    return subprocess.run([os.path.basename(program), *arguments, "--help-all"], executable=program, check=True,
                          stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8", env=environment).stdout


def read_program(program):
    """The command of a program, with those of its subcommands."""
    name = os.path.basename(program)
    command = parse(name, help_of(program))
    for i, listed in enumerate(command.subcommands):
        word = listed.name.split()[-1]
        found = parse(listed.name, help_of(program, word))
        found.subcommands = [parse(sub.name, help_of(program, word, sub.name.split()[-1])) for sub in found.subcommands]
        found.summary = found.summary or listed.summary
        if not found.options:
            raise SystemExit(f"{program} {word} --help-all lists no options: its form is another one than {__file__} reads")
        command.subcommands[i] = found
    if not command.options:
        raise SystemExit(f"{program} --help-all lists no options: its form is another one than {__file__} reads")
    return command
