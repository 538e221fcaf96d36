"""Planners: each makes of the kinematic fit of a whole clip the reference that the simulation then follows.

A planner is a row of `PLANNERS`, chosen by `--planner`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from simrecon import kinematics
from simrecon.errors import InputError
from simrecon.plan import Plan
from simrecon.planners import centroidal, none, soft_contact
from simrecon.types import Evidence, KinematicFit, Reference

Planner = Callable[[KinematicFit, Evidence, Plan], Reference]
"""Of the fit, the evidence on the same uniform frames, and the settings; the scene is that of the fit."""

PLANNERS: dict[str, Planner] = {
    "none": none.plan,
    "soft_contact": soft_contact.plan,
    "centroidal": centroidal.plan,
}


def names() -> tuple[str, ...]:
    """Names of the planners."""
    return tuple(PLANNERS)


def check(name: str) -> None:
    """Check that there is a planner.

    Raises:
        InputError: there is none of that name.
    """
    if name not in PLANNERS:
        raise InputError(f"there is no planner {name!r}; valid: {', '.join(PLANNERS)}")


def plan(name: str, fit: KinematicFit, evidence: Evidence, settings: Plan) -> Reference:
    """Plan a clip.

    Args:
        name: of the planner.
        fit: the kinematic half.
        evidence: on the frames of the fit.
        settings: of the whole run.

    Raises:
        InputError: there is no such planner.
    """
    check(name)
    return PLANNERS[name](fit, evidence, settings)


def embodied(fit: KinematicFit, reference: Reference) -> KinematicFit:
    """The fit on the body of its reference, where a plan has moved lengths: a result has one body."""
    if reference.body is None:
        return fit
    com, _ = kinematics.configurations(reference.body, fit.qpos)
    return replace(fit, body=reference.body, com_m=com)
