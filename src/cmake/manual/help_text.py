# SPDX-License-Identifier: Apache-2.0
"""Reads what a program prints for --help into commands, options and their values: the source of man pages and completions."""
import dataclasses
import os
import re
import subprocess

# Entries of a section are indented by less, the lines that continue them by more
CONTINUATION_INDENT = 8
# What may stand behind an option's name and value, with the text on the lines below
OF_THE_HEAD = re.compile(r"in \[|[-\w.+]+\]|- |x \d|\.\.\.|REQUIRED|Needs:|Excludes:")


@dataclasses.dataclass
class Option:
    names: list
    value: str  # placeholder for the value, empty for a switch
    text: str = ""

    @property
    def choices(self):
        listed = re.search(r"\{([^{}]+)\}", self.value)
        return listed[1].split(",") if listed else []

    @property
    def is_number(self):
        return bool(re.match(r"(INT|UINT|FLOAT)\b", self.value))

    @property
    def is_repeatable(self):
        return "..." in self.value


@dataclasses.dataclass
class Command:
    name: str  # "velatura", or "velatura render"
    summary: str = ""
    usage: str = ""
    footer: str = ""
    positionals: list = dataclasses.field(default_factory=list)  # Option with one name
    groups: dict = dataclasses.field(default_factory=dict)  # title: options
    subcommands: list = dataclasses.field(default_factory=list)  # Command

    @property
    def options(self):
        return [o for group in self.groups.values() for o in group]


def parse_option(head, text):
    names, _, value = head.partition(" ")
    value, conditions = re.match(r"(.*?)\s*((?:(?:Needs|Excludes):.*)?)$", value.replace("REQUIRED", "").strip()).groups()
    text = f"{text}; {conditions[:1].lower()}{conditions[1:]}" if conditions else text
    # CLI11 writes TYPE:CHECK, and how many words it takes; the check says more, and names of words say how many
    value = re.sub(r"^(\w+):(?=\{|\w+ in \[|\1\b)", "", value)
    value = re.sub(r"(?<=\S) x \d+$", "", value) if " " in value.partition(" x ")[0] else value
    return Option(names.split(","), value, text)


def entries(lines):
    """(head, text) of each entry: two columns, or the text on the lines below."""
    # A head that fills its column has one space behind it
    columns = [len(line) - len(line[found.end():]) for line in lines if (found := re.match(r" *\S.*?  +(?=\S)", line))]
    column = max(set(columns), key=columns.count, default=0)
    found = []
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if indent >= CONTINUATION_INDENT and found:
            found[-1][1] = f"{found[-1][1]} {line.strip()}".strip()
        elif column and line[column - 1:column] == " " and line[column:column + 1].strip() and not OF_THE_HEAD.match(line[column:]):
            found.append([line[:column].strip(), line[column:].strip()])
        else:
            head, _, text = re.sub(r" {2,}", "\t", line.strip(), count=1).partition("\t")
            found.append([head, text.strip()])
    return found


def parse(name, text):
    command = Command(name)
    sections, title, group = [("", [])], "", ""
    for line in text.splitlines():
        of_group = re.match(r"\s*\[Option Group: (.+)\]\s*$", line)
        heading = re.match(r"\s{0,4}([A-Z][\w ]*):\s*$", line)
        if of_group:
            group = of_group[1]
        elif heading:
            title = heading[1] if heading[1] in ("Positionals", "Subcommands") else group or heading[1]
            sections.append((title, []))
        elif line.strip() and not line.startswith(" ") and sections[-1][0]:
            # Text at the left margin ends a section
            sections.append(("", [line]))
            group = ""
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
        if title == "Positionals":
            command.positionals += [parse_option(head, text) for head, text in entries(lines)]
        elif title == "Subcommands":
            command.subcommands += [Command(f"{name} {head}", text) for head, text in entries(lines)]
        elif title:
            command.groups.setdefault(title, []).extend(
                parse_option(head, text) for head, text in entries(lines) if head.startswith("-"))
    return command


def help_of(program, *arguments):
    # Sanitizers look for leaks at the end of a process, which is not what is asked here
    environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=0", LC_ALL="C.UTF-8")
    # By its name alone, which stands in the usage line
    return subprocess.run([os.path.basename(program), *arguments, "--help"], executable=program, check=True,
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
            raise SystemExit(f"{program} {word} --help lists no options: its form is another one than {__file__} reads")
        command.subcommands[i] = found
    if not command.options:
        raise SystemExit(f"{program} --help lists no options: its form is another one than {__file__} reads")
    return command
