"""The planner `centroidal`: contacts and centroidal dynamics of a whole clip (Rempe et al. 2020).

settings    all numbers, from `models/planner/centroidal.toml`
kinematic   the paper's own motion to begin with, which may stand for the fit's; energies, plane
inputs      the person of a fit as one body with points that touch; points, phases, touching, euler;
            labelling, resting: which contacts there are
model       that body as unknown curves; curves, limbs
laws        constraints: geometric and dynamic ones; rotation
program     IPOPT
stages      the search
planned     what it found, at the frames
fullbody    the full body that moves so
residual    what its motion leaves unexplained
unseen      feet that nobody saw

The modules from `curves` on need CasADi, the extra `centroidal`.
"""

from __future__ import annotations

import numpy as np

from simrecon.contact.parts import parts
from simrecon.errors import InputError
from simrecon.io.messages import counted
from simrecon.kinematics import configurations
from simrecon.plan import Plan
from simrecon.planners.centroidal import kinematic, unseen
from simrecon.planners.centroidal.settings import chosen
from simrecon.scene import sheets
from simrecon.system import blas, extras
from simrecon.types import Evidence, KinematicFit, Reference

NAME = "centroidal"
FEWEST = 6
"""Frames that have a velocity over five of them."""


@blas.one_thread()
def plan(fit: KinematicFit, evidence: Evidence, wanted: Plan) -> Reference:
    """A motion near the fit that forces at its contacts explain, and these forces.

    Args:
        fit: the kinematic half.
        evidence: on the frames of the fit.
        wanted: weights of the kinematic terms of the full body, and the section `centroidal`.

    Raises:
        InputError: CasADi is missing, the clip is too short, its floor or an item gives way, or nothing can
            be projected though the plan is to start as the paper.
    """
    check(fit)
    extras.load("casadi", NAME, f"planner {NAME}")
    numbers = chosen(wanted.centroidal.weights)
    if wanted.centroidal.start == "paper":
        fit, _ = kinematic.optimised(fit, evidence, wanted, numbers)
    from simrecon.planners.centroidal import solving

    planned = solving.planned(fit, numbers)
    qpos = solving.full_body(fit, planned, wanted.kinematics, numbers.body)
    places, forces = np.swapaxes(planned.places_m, 0, 1), np.swapaxes(planned.force_N, 0, 1)  # (T, P, 3)
    return Reference(
        planner=NAME,
        times_s=fit.times_s,
        qpos=qpos,
        com_m=configurations(fit.body, qpos)[0],
        contact_names=tuple(point.name for point in planned.points),
        contact=planned.contact.T.astype(float),
        contact_segments=tuple(fit.body.skeleton.names[point.segment] for point in planned.points),
        contact_parts=tuple(_primitive(point.name) for point in planned.points),
        contact_force_N=forces,
        contact_place_m=places,
        root_wrench=solving.wrench(fit.body, qpos, fit.times_s, places, forces),
        notes=(*unseen.feet(evidence), *planned.notes),
    )


def _primitive(part: str) -> str:
    """The first primitive of a part of the body (`contact.parts`)."""
    return next(name for known in parts() if known.name == part for name in known.at)


def check(fit: KinematicFit) -> None:
    """Refuse what it cannot plan.

    Raises:
        InputError: the clip is too short, or its floor or an item gives way.
    """
    if len(fit.times_s) < FEWEST:
        count = counted(len(fit.times_s), "frame")
        raise InputError(
            f"planner {NAME}: found {count}; valid: {FEWEST} or more, for velocities at its ends"
        )
    ground = fit.scene.ground
    if ground.stiffness_Npm is not None or ground.calibrate:
        raise InputError(
            f"planner {NAME}: the scene's floor is compliant ([ground] stiffness_Npm); "
            "valid: a hard floor, or planner none or soft_contact"
        )
    for item in fit.scene.items:
        if sheets.depth_m(item):
            raise InputError(
                f"planner {NAME}: the scene's {item.kind} {item.name!r} gives way; "
                "valid: hard items, or planner none or soft_contact"
            )


__all__ = ["plan"]
