"""The options of a job on the command line, the same for every command that simulates."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from simrecon import engines, plan, planners, scene
from simrecon.errors import InputError
from simrecon.job import Job
from simrecon.job.text import Option, options, with_options

TITLES = {
    "": "the run",
    "reading": "how the input is read, where it doesn't say so itself",
    "person": "the person",
}


def add(
    parser: argparse.ArgumentParser, *, recalls: bool = False, sections: tuple[str, ...] = tuple(TITLES)
) -> None:
    """Add the options of a job; what is not given is None.

    Args:
        parser: of a command.
        recalls: whether the command takes what is not given from an earlier job.
        sections: of the options that the command has.
    """
    groups = {section: parser.add_argument_group(TITLES[section]) for section in sections}

    def default(text: str) -> str:
        return "that of before" if recalls else text

    run = groups[""]
    run.add_argument(
        "--plan", metavar="PLAN", help=f"{', '.join(plan.names())}, or a path [{default('default')}]"
    )
    run.add_argument(
        "--scene", metavar="FILE", help=f"floor and items (scene.toml) [{default('a floor at z = 0')}]"
    )
    run.add_argument(
        "--planner",
        choices=planners.names(),
        help=f"what turns the kinematic fit into the reference [{default('none')}]",
    )
    run.add_argument(
        "--engine", choices=engines.names(), help=f"what optimises the simulation [{default('sampling')}]"
    )
    for option in options():
        if option.section in groups:
            _add(groups[option.section], option)


def given(parsed: argparse.Namespace) -> dict[str, Any]:
    """The options of a job that were given, by name."""
    return {
        option.name: value
        for option in options()
        if (value := getattr(parsed, option.name, None)) is not None
    }


def apply(parsed: argparse.Namespace, job: Job) -> Job:
    """The job with all that was given on the command line.

    Raises:
        InputError: there is no such plan, or the scene can't be read.
    """
    changes: dict[str, Any] = {}
    if parsed.plan is not None:
        changes["plan"] = plan.read(parsed.plan)
    if parsed.scene is not None:
        changes["scene"] = scene.read(parsed.scene)
    for name in ("planner", "engine"):
        if getattr(parsed, name) is not None:
            changes[name] = getattr(parsed, name)
    return with_options(replace(job, **changes), given(parsed))


def _add(group: Any, option: Option) -> None:
    if option.is_switch:
        group.add_argument(
            option.flag, dest=option.name, action="store_true", default=None, help=option.rules["help"]
        )
        return
    choices = option.key.choices
    plain_choice = bool(choices) and option.rules.get("metavar") is None
    group.add_argument(
        option.flag,
        dest=option.name,
        type=str if plain_choice else _reader(option),
        choices=choices if plain_choice else None,
        metavar=option.rules.get("metavar"),
        help=option.rules["help"],
    )


def _reader(option: Option) -> Callable[[str], Any]:
    def parse(text: str) -> Any:
        try:
            return option.parse(text)
        except InputError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return parse
