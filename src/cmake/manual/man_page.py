# SPDX-License-Identifier: Apache-2.0
"""Writes a command, as help_text reads it, as a man page."""
import re


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def page_name(command):
    return command.name.replace(" ", "-")


def lowered(sentence):
    """Summaries of names begin in lower case, but for acronyms."""
    return sentence[:1].lower() + sentence[1:] if sentence[1:2].islower() else sentence


def summary_line(command):
    program = command.name.split()[0]
    text = re.sub(rf"^{program}:\s*", "", command.summary, flags=re.IGNORECASE)
    return lowered(text.rstrip("."))


def entry(option):
    names = ", ".join(f"\\fB{roff(name)}\\fR" for name in option.names)
    value = f" \\fI{roff(option.value)}\\fR" if option.value else ""
    return [".TP", names + value, roff(option.full_text) or "\\&"]


def exit_status(footer):
    """Entries of "Exit codes: 0 done, 1 file error, …", or nothing if the footer is another one."""
    listed = re.match(r"Exit codes:\s*(.+?)\.?$", footer)
    if not listed:
        return []
    codes = re.split(r",\s*(?=\d)", listed[1])
    return [".SH EXIT STATUS"] + [
        line for code in codes for line in (".TP", f"\\fB{roff(code.split(' ')[0])}\\fR", roff(code.partition(" ")[2]))]


def man_page(command, version, root):
    program = root.name
    lines = ["'\\\" -*- coding: utf-8 -*-", f".\\\" Generated from the output of {command.name} --help-all.",
             f".TH {roff(page_name(command)).upper()} 1 \"\" \"{program} {version}\" \"User Commands\"",
             ".nh", ".SH NAME", f"{roff(page_name(command))} \\- {roff(summary_line(command))}",
             ".SH SYNOPSIS", f".B {roff(command.name)}",
             roff(command.usage.removeprefix(command.name).strip() or "[OPTIONS]")]
    if command.positionals:
        lines.append(".SH ARGUMENTS")
        for positional in command.positionals:
            lines += entry(positional)
    if command.subcommands:
        lines.append(".SH COMMANDS")
        for sub in command.subcommands:
            lines += [".TP", f"\\fB{roff(sub.name.split()[-1])}\\fR", f"{roff(sub.summary)}; see {roff(page_name(sub))}(1)"]
    lines.append(".SH OPTIONS")
    for title, options in command.groups.items():
        if title != "Options":
            lines.append(f".SS {roff(title)}")
        for option in options:
            lines += entry(option)
    if command.examples:
        lines += [".SH EXAMPLES", ".nf", *(roff(example) for example in command.examples), ".fi"]
    status = exit_status(command.footer or root.footer)
    lines += status
    if command.footer and not status:
        lines += [".SH NOTES", roff(command.footer)]
    others = root.subcommands if command is root else [root]
    if others:
        lines += [".SH SEE ALSO", ", ".join(f"{roff(page_name(other))}(1)" for other in others)]
    return "\n".join(lines) + "\n"
