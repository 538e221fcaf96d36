"""`simrecon rerun`: a finished result again, in an edited scene or with another plan."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from simrecon import evidence, scene
from simrecon.cli import arguments, run
from simrecon.errors import InputError
from simrecon.results import folder
from simrecon.types import Evidence, Report


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    rerun = arguments.command(
        commands, "rerun", _rerun, "a finished result again, from its motion on, in an edited scene"
    )
    rerun.add_argument("result", metavar="OUT", help="result folder to start from")
    rerun.add_argument("-o", dest="output", metavar="OUT2", help="result folder [OUT, which is replaced]")
    rerun.add_argument("--scene", metavar="FILE", help="edited scene (scene.toml) [that of OUT]")
    rerun.add_argument("--input", metavar="FILE", help="the evidence, if it is not where it was")
    rerun.add_argument("--video", metavar="FILE", help="what the overlay is drawn on [plain ground]")
    run._add_settings(rerun, plan_name=None)


def _rerun(options: argparse.Namespace) -> int:
    motion, report = folder.read(options.result), folder.read_report(options.result)
    given = _evidence(options, report)
    options.input = options.input or report["input"]["name"]
    if options.plan is None:
        options.plan = report["plan_name"]
    options.output = options.output or options.result
    things = scene.read(options.scene or Path(options.result) / folder.SCENE)
    return run._make(options, given, things, start=motion)


def _evidence(options: argparse.Namespace, report: Report) -> Evidence:
    """The evidence of the result, with the person's size as it was found."""
    file = options.input or report["input"]["name"]
    if not Path(file).is_file():
        raise InputError(f"{file}: the evidence of {options.result} is not there; --input says where it is")
    given = evidence.read(file)
    if given.sha256 != report["input"]["sha256"]:
        raise InputError(
            f"{file}: is not the evidence that {options.result} was made from (its sha256 differs)"
        )
    person = report["person"]
    return replace(given, height_m=person["height_m"], mass_kg=person["mass_kg"])
