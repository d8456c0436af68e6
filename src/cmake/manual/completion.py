# SPDX-License-Identifier: Apache-2.0
"""Writes a program, as help_text reads it, as completion scripts of bash, zsh and fish."""
import re

HEADER = "# Completion of {name} for {shell}; generated from the output of {name} --help.\n"


def brief(text):
    """The first clause: shells show one line per candidate. A clause of one word before a colon says too little."""
    clause = re.split(r"\s*(?:;|\(|:\s|\.\s+(?=[A-Z]))", text, maxsplit=1)[0].strip()
    if " " not in clause:
        clause = re.split(r"\s*[;(]", text, maxsplit=1)[0].strip()
    return clause if len(clause) <= 72 else clause[:72].rsplit(" ", 1)[0] + "…"


def word_of(command):
    return command.name.split()[-1]


def identifier(name):
    return re.sub(r"\W", "_", name)


def bash(program):
    commands = [program, *program.subcommands]
    options, values = [], []
    for command in commands:
        word = "" if command is program else word_of(command)
        names = " ".join(name for o in command.options for name in o.names)
        options.append(f"        '{word}') options='{names}' ;;")
        for option in command.options:
            if not option.value:
                continue
            pattern = " | ".join(f"'{word} {name}'" for name in option.names)
            if option.choices:
                values.append(f"        {pattern}) is_value=1 values='{' '.join(option.choices)}' ;;")
            elif option.is_number:
                values.append(f"        {pattern}) return ;;")
            else:
                values.append(f"        {pattern}) is_value=1 ;;")
    words = " ".join(word_of(sub) for sub in program.subcommands)
    return HEADER.format(name=program.name, shell="bash") + f"""
_{identifier(program.name)}() {{
    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}}
    local commands='{words}' command='' options='' values='' is_value='' i
    COMPREPLY=()
    for ((i = 1; i < COMP_CWORD; ++i)); do
        if [[ -n $commands && " $commands " == *" ${{COMP_WORDS[i]}} "* ]]; then
            command=${{COMP_WORDS[i]}}
            break
        fi
    done
    # --option=value comes as three words
    if [[ $current == = ]]; then
        current=''
    elif [[ $previous == = ]]; then
        previous=${{COMP_WORDS[COMP_CWORD - 2]}}
    fi
    case $command in
{chr(10).join(options)}
    esac
    case "$command $previous" in
{chr(10).join(values) or "        *) ;;"}
    esac
    if [[ -n $is_value ]]; then
        if [[ -n $values ]]; then COMPREPLY=($(compgen -W "$values" -- "$current")); else compopt -o default; fi
    elif [[ $current == -* ]]; then
        COMPREPLY=($(compgen -W "$options" -- "$current"))
    elif [[ -n $commands && -z $command ]]; then
        COMPREPLY=($(compgen -W "$commands" -- "$current"))
    else
        compopt -o default
    fi
}}

complete -F _{identifier(program.name)} {program.name}
"""


def zsh_text(text):
    return re.sub(r"([\[\]:\\])", r"\\\1", text).replace("'", "'\\''")


def zsh_option(option):
    repeat = "*" if option.is_repeatable else ""
    action = ""
    if option.value:
        what = zsh_text(re.sub(r"[{}].*", "", option.value).strip() or "value")
        action = f":{what}:"
        if option.choices:
            action += f"({' '.join(option.choices)})"
        elif not option.is_number:
            action += "_files"
    text = zsh_text(brief(option.text))
    names = [name + "=" if option.value and name.startswith("--") else name for name in option.names]
    if len(names) == 1:
        return f"'{repeat}{names[0]}[{text}]{action}'"
    head = f"'{repeat}'" if repeat else f"'({' '.join(option.names)})'"
    return f"{head}{{{','.join(names)}}}'[{text}]{action}'"


def zsh_arguments(command, indent, last):
    lines = [zsh_option(option) for option in command.options] + last
    return " \\\n".join(" " * indent + line for line in lines)


def zsh(program):
    name = identifier(program.name)
    if not program.subcommands:
        return f"#compdef {program.name}\n" + HEADER.format(name=program.name, shell="zsh") + f"""
_arguments -S \\
{zsh_arguments(program, 4, ["'*:file:_files'"])}
"""
    described = "\n".join(f"                '{word_of(s)}:{zsh_text(brief(s.summary))}'" for s in program.subcommands)
    cases = "\n".join(f"""                {word_of(s)})
                    _arguments -S \\
{zsh_arguments(s, 24, ["'*:file:_files'"] if s.positionals else [])}
                    ;;""" for s in program.subcommands)
    return f"#compdef {program.name}\n" + HEADER.format(name=program.name, shell="zsh") + f"""
_{name}() {{
    local state line context
    local -a commands
    typeset -A opt_args
    _arguments -C \\
{zsh_arguments(program, 8, ["'1:command:->command'", "'*::argument:->arguments'"])}
    case $state in
        command)
            commands=(
{described}
            )
            _describe -t commands command commands
            ;;
        arguments)
            case $words[1] in
{cases}
            esac
            ;;
    esac
}}

_{name} "$@"
"""


def fish_text(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def fish_option(program, option, condition):
    parts = ["complete -c", program.name, *([f"-n '{condition}'"] if condition else [])]
    for name in option.names:
        parts.append(f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}")
    if option.choices:
        parts.append(f"-x -a '{' '.join(option.choices)}'")
    elif option.is_number:
        parts.append("-x")
    elif option.value:
        parts.append("-r -F")
    return " ".join([*parts, "-d", fish_text(brief(option.text))])


def fish(program):
    lines = [HEADER.format(name=program.name, shell="fish").rstrip()]
    before = "__fish_use_subcommand" if program.subcommands else ""
    lines += [fish_option(program, option, before) for option in program.options]
    for sub in program.subcommands:
        word = word_of(sub)
        lines.append(f"complete -c {program.name} -n {before} -f -a {word} -d {fish_text(brief(sub.summary))}")
        lines += [fish_option(program, option, f"__fish_seen_subcommand_from {word}") for option in sub.options]
    return "\n".join(lines) + "\n"


def files(program):
    """Where Debian's shells look below share/, and what belongs there."""
    name = program.name
    return {f"bash-completion/completions/{name}": bash(program),
            f"zsh/vendor-completions/_{name}": zsh(program),
            f"fish/vendor_completions.d/{name}.fish": fish(program)}
