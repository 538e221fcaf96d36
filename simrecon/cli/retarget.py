"""`simrecon retarget`: the motion of a finished result on another body, simulated."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import body as bodies
from simrecon import kinematics, plan, results
from simrecon.body import known, mass
from simrecon.cli import arguments, run
from simrecon.errors import InputError
from simrecon.kinematics import retargeting
from simrecon.results import folder, kinematic
from simrecon.system.progress import Progress
from simrecon.types import Body

WANTED = ("betas", "body_model", "height_m", "mass_kg", "mass_distribution")


def add(commands: Any) -> None:
    """Add the command to the subparsers of the program."""
    parser = arguments.command(
        commands, "retarget", _retarget, "the motion of a finished result on another body, simulated"
    )
    parser.add_argument("result", metavar="OUT", help="result folder whose kinematic motion is taken")
    parser.add_argument(
        "-o", dest="output", metavar="NEW", required=True, help="result folder, which is made"
    )
    run._add_body(parser)
    run._add_settings(parser, plan_name=None)


def _retarget(options: argparse.Namespace) -> int:
    if all(getattr(options, name) is None for name in WANTED):
        valid = ", ".join(f"--{name.replace('_', '-')}" for name in WANTED)
        raise InputError(f"retarget: found no other body; valid: one or more of {valid}")
    results.check_writable(options.output)
    if options.plan is None:
        options.plan = folder.read_report(options.result)["plan_name"]
    settings = plan.read(options.plan)
    given, before = kinematic.read(options.result)
    person = _body(options, before.body)
    with Progress(1.0, "retargeting") as progress:
        fit = kinematics.retarget(before, person, settings.kinematics)
        progress.update(1.0)
    scale = retargeting.scale_of(before, person)
    given = replace(given, reading=f"{given.reading}, scaled by {scale:.4g} to another body")
    options.input, options.video = Path(options.result) / folder.MOTION, None
    return run._make(options, given, fit.scene, fit=fit)


def _body(options: argparse.Namespace, before: Body) -> Body:
    """The other body: of betas, or the one before with what is to be changed.

    A distribution of mass comes with the mass of the character that it was made for.
    """
    mass_kg, distribution = options.mass_kg, options.mass_distribution
    if mass_kg is None and distribution is not None:
        mass_kg = mass.distribution(distribution).mass_kg
    if options.betas is None and options.body_model is None:
        return known.changed(before, height_m=options.height_m, mass_kg=mass_kg, distribution=distribution)
    betas, shapes = run._shape(options)
    return bodies.build(
        betas=np.zeros(shapes.size) if betas is None else betas,
        height_m=options.height_m,
        mass_kg=mass_kg,
        shapes=shapes,
        distribution=distribution or "standard",
    )
