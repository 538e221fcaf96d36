"""`simrecon completion`: a script by which a shell completes commands, options and their words."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from simrecon.cli import arguments, commands
from simrecon.cli.arguments import Parser

PROGRAM = "simrecon"
SHELLS = ("bash", "zsh", "fish")
_BASH = """\
_simrecon() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" path="" part words="" i
    for ((i = 1; i < COMP_CWORD; i++)); do
        part="$path ${{COMP_WORDS[i]}}"
        case "${{part# }}" in
            {paths}) path="${{part# }}" ;;
        esac
    done
    case "$path $before" in
{values}
        *)
            case "$path" in
{names}
            esac
            ;;
    esac
    COMPREPLY=($(compgen -W "$words" -- "$word"))
    if [[ $word != -* && -n $path && ${{#COMPREPLY[@]}} -eq 0 ]]; then
        COMPREPLY=($(compgen -f -- "$word"))
    fi
}}
complete -o filenames -F _simrecon simrecon
"""


@dataclass(frozen=True)
class Entry:
    """A command: its words on the command line, what may follow them, and words that options take."""

    path: str
    commands: tuple[str, ...]
    options: tuple[str, ...]
    values: dict[str, tuple[str, ...]]


def add(parsers: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(parsers, "completion", _completion, commands.purpose("completion"))
    parser.add_argument("shell", choices=SHELLS, help="of which to print the script")
    parser.epilog = (
        'In bash: eval "$(simrecon completion bash)", as a line of ~/.bashrc; zsh and fish likewise.'
    )


def _completion(parsed: argparse.Namespace) -> int:
    print(script(parsed.shell), end="")
    return 0


def script(shell: str) -> str:
    """The script for a shell of `SHELLS`."""
    program = Parser(prog=PROGRAM, allow_abbrev=False)
    commands.add_all(program.add_subparsers())
    entries = list(_entries(program, ""))
    if shell == "fish":
        return "".join(_fish(entries))
    ahead = "autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else ""
    return ahead + _bash(entries)


def _entries(parser: argparse.ArgumentParser, path: str) -> Iterator[Entry]:
    inner: dict[str, argparse.ArgumentParser] = {}
    options: list[str] = []
    values: dict[str, tuple[str, ...]] = {}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            inner |= action.choices
        flags = [flag for flag in action.option_strings if flag.startswith("--") or len(flag) == 2]
        options += flags
        if words := tuple(map(str, getattr(action, "words", None) or action.choices or ())):
            values |= dict.fromkeys(flags, words)
    if isinstance(parser, Parser):
        inner |= parser.words
    yield Entry(path, tuple(inner), tuple(options), values)
    for name, one in inner.items():
        yield from _entries(one, f"{path} {name}".strip())


def _bash(entries: list[Entry]) -> str:
    paths = "|".join(f'"{entry.path}"' for entry in entries if entry.path)
    values = [
        f'        "{entry.path} {flag}") words="{" ".join(words)}" ;;'
        for entry in entries
        for flag, words in entry.values.items()
    ]
    names = [
        f'                "{entry.path}") words="{" ".join((*entry.commands, *entry.options))}" ;;'
        for entry in entries
    ]
    return _BASH.format(paths=paths, values="\n".join(values), names="\n".join(names))


def _fish(entries: list[Entry]) -> Iterator[str]:
    for entry in entries:
        seen = [f"__fish_seen_subcommand_from {word}" for word in entry.path.split()]
        if entry.commands:
            rest = f"not __fish_seen_subcommand_from {' '.join(entry.commands)}"
            where, words = " ; and ".join((*seen, rest)), " ".join(entry.commands)
            yield f"complete -c {PROGRAM} {'' if entry.path else '-f '}-n '{where}' -a '{words}'\n"
        where = f" -n '{' ; and '.join(seen)}'" if seen else ""
        for option in entry.options:
            kind, name = ("-l", option[2:]) if option.startswith("--") else ("-s", option[1:])
            given = f" -x -a '{' '.join(entry.values[option])}'" if option in entry.values else ""
            yield f"complete -c {PROGRAM}{where} {kind} {name}{given}\n"
