"""The options of a job on the command line, the same for every command that simulates."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from simrecon import engines, plan, planners, scene
from simrecon.cli.arguments import Parser
from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.io.messages import hint
from simrecon.job import Job, request
from simrecon.job.text import Option, defaults, options, with_options

_DASHED = re.compile(r"-([xyz]$|\.?\d)")
"""Values that begin with a dash: axes and numbers."""
_DEFAULT = re.compile(r" \[[^]]*\]$")
"""The end of a line of help, which says what holds without the option."""
SUGGEST = "suggest"
"""As `--scene`: the scene as it is, and the supports that are missing in it."""
_FILES = {option.name for option in options() if option.section == "reading" and option.rules.get("file")}
"""Options of the reading that name files, which may hold something else by now."""
TITLES = {
    "": "the run",
    "reading": "how the input is read, where it does not say so itself",
    "person": "the person",
}


def add(
    parser: argparse.ArgumentParser,
    *,
    recalls: Callable[[str], bool] = lambda _: False,
    sections: tuple[str, ...] = tuple(TITLES),
    without: tuple[str, ...] = (),
    forgets: bool = False,
) -> None:
    """Add the options of a job; what is not given is None.

    Args:
        parser: of a command.
        recalls: whether the command takes an option that is not given, by name, from an earlier job.
        sections: of the options that the command has.
        without: names of options in them that it does not have.
        forgets: whether options of an earlier job can be taken back.
    """
    if isinstance(parser, Parser):
        parser.joined = joined
    groups = {section: parser.add_argument_group(TITLES[section]) for section in sections}

    def text(name: str, usual: str) -> str:
        return f"{_DEFAULT.sub('', usual)} [as before]" if recalls(name) else usual

    if "" in groups:
        _add_own(groups[""], text)
    if forgets:
        words = "options of the earlier job that hold no longer, such as ignore,fov"
        groups[""].add_argument("--forget", type=_names, metavar="NAME,…", help=words)
    for option in options():
        if option.section in groups and option.name not in without:
            _add(groups[option.section], option, text(option.name, option.rules["help"]))


def _add_own(run: Any, text: Callable[[str, str], str]) -> None:
    """The options that are read from files or chosen by name."""
    plans = f"{', '.join(plan.names())}, or a path [default]"
    chosen = run.add_argument("--plan", metavar="PLAN", help=text("plan", plans))
    chosen.words = plan.names()  # for completion
    room = "floor and items (scene.toml), or suggest: with supports that the motion needs [a floor at z = 0]"
    run.add_argument("--scene", metavar="FILE", help=text("scene", room))
    asked = "which parts touch when (contacts.toml, see docs/contacts.md) [as found]"
    run.add_argument("--contacts", metavar="FILE", help=text("contacts", asked))
    reference = "what turns the kinematic fit into the reference [as the plan says]"
    run.add_argument("--planner", choices=planners.names(), help=text("planner", reference))
    optimiser = "what optimises the simulation [sampling]"
    run.add_argument("--engine", choices=engines.names(), help=text("engine", optimiser))
    run.add_argument(
        "--replace", action="store_true", help="replace an earlier result in OUT even if it is better"
    )


def joined(words: Sequence[str]) -> list[str]:
    """Words of a command line, with `--up -y` as `--up=-y` and `--betas -1,2` as `--betas=-1,2`.

    argparse takes a value that begins with a dash for an option.
    """
    flags = {option.flag for option in options() if not option.is_switch}
    found: list[str] = []
    for word in words:
        if found and found[-1] in flags and _DASHED.match(word):
            found[-1] += f"={word}"
        else:
            found.append(word)
    return found


def given(parsed: argparse.Namespace) -> dict[str, Any]:
    """The options of a job that were given, by name."""
    return {
        option.name: value
        for option in options()
        if (value := getattr(parsed, option.name, None)) is not None
    }


def apply(parsed: argparse.Namespace, job: Job) -> Job:
    """The job with all that was given on the command line; files that were named are taken as they are now.

    Landmarks of a video are found anew if they are to be read in another way, and a motion that begins at
    another time is no start.

    Raises:
        InputError: there is no such plan, or the scene can't be read.
    """
    changes: dict[str, Any] = {}
    if parsed.plan is not None:
        changes["plan"] = plan.read(parsed.plan)
    if parsed.scene == SUGGEST:
        changes["suggest"] = True
    elif parsed.scene is not None:
        changes["scene"] = scene.read(parsed.scene)
    if parsed.contacts is not None:
        changes["contacts"] = wishes.read(parsed.contacts)
    for name in ("planner", "engine"):
        if getattr(parsed, name) is not None:
            changes[name] = getattr(parsed, name)
    said = given(parsed)
    values = defaults(getattr(parsed, "forget", None) or ()) | said
    again = with_options(replace(job, **changes), values)
    if _FILES & set(said) or request.detected_by(job) != request.detected_by(again):
        again = replace(again, detected=None)
    if again.start is not None and again.reading.from_s != job.reading.from_s:
        print("another --from than before: begins with the kinematic fit", file=sys.stderr)
        again = replace(again, start=None)
    meshes = () if parsed.scene in (None, SUGGEST) else request.meshes_of(again)
    return request.taken_anew(again, (*values, *meshes))


def _add(group: Any, option: Option, text: str) -> None:
    if option.is_switch:
        group.add_argument(option.flag, dest=option.name, action="store_true", default=None, help=text)
        return
    choices = option.key.choices
    plain_choice = bool(choices) and option.rules.get("metavar") is None
    action = group.add_argument(
        option.flag,
        dest=option.name,
        type=str if plain_choice else _reader(option),
        choices=choices if plain_choice else None,
        metavar=option.rules.get("metavar"),
        help=text,
    )
    action.words = choices or option.rules.get("numbers")  # for completion


def _names(text: str) -> tuple[str, ...]:
    """Names of options between commas, with or without their unit."""
    known = {option.flag.removeprefix("--"): option.name for option in options()}
    names = known | {name: name for name in known.values()}
    for word in text.split(","):
        if word not in names:
            valid = ", ".join(known)
            raise argparse.ArgumentTypeError(f"found {word!r}{hint(word, names)}; valid: {valid}")
    return tuple(names[word] for word in text.split(","))


def _reader(option: Option) -> Callable[[str], Any]:
    def parse(text: str) -> Any:
        try:
            return option.parse(text)
        except InputError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return parse
