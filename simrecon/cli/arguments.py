"""Pieces that the commands make their arguments of."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from typing import Any, NoReturn

from simrecon.errors import InputError
from simrecon.io.messages import hint
from simrecon.io.paths import is_usable


class Parser(argparse.ArgumentParser):
    """A parser whose errors are ours: one line.

    Attributes:
        words: words that, as the first argument, are commands of their own, with their parsers.
        joined: puts values that begin with a dash behind their options, before the words are parsed.
    """

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.words: dict[str, Parser] = {}
        self.joined: Callable[[list[str]], list[str]] = list

    def word(self, name: str, function: Callable[[argparse.Namespace], int], purpose: str) -> Parser:
        """A command of its own behind this one's name, beside arguments of any form."""
        self.words[name] = Parser(prog=f"{self.prog} {name}", **_settings(purpose))
        return _started(self.words[name], function)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Hand over to the parser of the first word, if it has one; else join words, and check options."""
        if args and args[0] in self.words and not any(word.startswith("-o") for word in args):
            return self.words[args[0]].parse_known_args(args[1:], namespace)
        if args and self._subparsers is None:
            args = self.joined(args)
            self._check_options(args)
        return super().parse_known_args(args, namespace)

    def _check_options(self, words: list[str]) -> None:
        """Refuse an option that is none, with the one that may be meant."""
        for word in words:
            flag = word.partition("=")[0]
            if flag == "--":
                return
            if flag.startswith("--") and flag not in self._option_string_actions:
                known = [name for name in self._option_string_actions if name.startswith("--")]
                self.error(f"unknown option {flag}{hint(flag, known)}")

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        """Refuse a blank word where a path or a name is asked for."""
        if action.type is None and action.choices is None and not is_usable(arg_string):
            raise argparse.ArgumentError(
                action, f"found {arg_string!r}; valid: {action.metavar or action.dest}"
            )
        return super()._get_value(action, arg_string)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse a word that is none of the choices, with the one that may be meant."""
        if action.choices is not None and value not in action.choices:
            valid = [str(choice) for choice in action.choices]
            near = hint(str(value), valid)
            raise argparse.ArgumentError(
                action, f"invalid choice: {value!r}{near}; valid: {', '.join(valid)}"
            )

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, and where help is."""
        raise InputError(f"{message}; `{self.prog} -h` shows what is valid")


def command(commands: Any, name: str, function: Callable[[argparse.Namespace], int], purpose: str) -> Parser:
    """A command of the program.

    Args:
        commands: subparsers of the program.
        name: what the user types.
        function: runs the command with its options, returns the exit status.
        purpose: one line of help, in lower case.
    """
    parser: Parser = commands.add_parser(name, help=purpose, **_settings(purpose))
    return _started(parser, function)


def _settings(purpose: str) -> dict[str, Any]:
    return {"description": purpose[0].upper() + purpose[1:] + ".", "allow_abbrev": False}


def _started(parser: Parser, function: Callable[[argparse.Namespace], int]) -> Parser:
    """A parser that knows what it runs."""
    parser.set_defaults(command=function)
    parser.add_argument(
        "--debug", action="store_true", default=argparse.SUPPRESS, help="show the traceback of an error"
    )
    return parser


def whole(high: int) -> Callable[[str], int]:
    """Reads a whole number from 0 to `high`."""

    def parse(text: str) -> int:
        if not (text.isdecimal() and text.isascii() and len(text) < 20 and int(text) <= high):
            raise argparse.ArgumentTypeError(f"found {text!r}; valid: a whole number from 0 to {high}")
        return int(text)

    return parse


def numbers(text: str) -> list[float]:
    """Reads numbers between commas."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = [math.nan]
    if not all(math.isfinite(value) for value in values):
        raise argparse.ArgumentTypeError(f"found {text!r}; valid: numbers between commas, such as 0.5,-1.2")
    return values


def number(bounds: tuple[float, float]) -> Callable[[str], float]:
    """Reads a number within `bounds`."""
    low, high = bounds

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"found {text!r}; valid: a number from {low:g} to {high:g}")
        return value

    return parse
