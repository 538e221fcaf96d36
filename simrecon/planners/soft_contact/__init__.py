"""The planner `soft_contact`: the laws of motion enter the estimate before the simulation (Xie et al. 2021).

masses      the person as point masses
forces      the forces of a scene that explain a wrench best
physics     what moves the body, and what pushing costs
objective   both with the evidence terms of the kinematic fit
curvature   of all that, for the search

It goes on where the kinematic fit has ended, with the same unknowns, evidence and search, in rounds with ever
finer units of force and moment.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from simrecon.errors import InputError
from simrecon.io.messages import counted
from simrecon.kinematics import configurations, layout, search
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.resumed import resume
from simrecon.plan import Plan
from simrecon.planners.soft_contact.curvature import curvature
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.masses import Masses
from simrecon.planners.soft_contact.objective import Planned
from simrecon.planners.soft_contact.physics import Motion, World
from simrecon.system import blas
from simrecon.types import Array, Evidence, KinematicFit, Primitive, Reference

NAME = "soft_contact"
ROUNDS = (0.1, 0.03, 0.01)
"""Units of force and moment, as shares of body weight and of body weight times stature."""
FEWEST = 3
"""Frames that have an acceleration between them."""
EVALUATIONS = 50
"""Of a round, at most."""
WEIGHT = 1.0
TOUCHES = 0.02
"""Force, as a share of body weight, at which a contact counts as half closed (eq. 5)."""


@blas.one_thread()
def plan(fit: KinematicFit, evidence: Evidence, settings: Plan) -> Reference:
    """A motion near the evidence that the scene's forces explain, and these forces.

    Args:
        fit: the kinematic half.
        evidence: on the frames of the fit.
        settings: weights of the evidence terms.

    Raises:
        InputError: there is no evidence to plan with, or too little of it.
    """
    if len(fit.times_s) < FEWEST:
        count = counted(len(fit.times_s), "frame")
        raise InputError(f"planner {NAME}: found {count}; valid: {FEWEST} or more, for accelerations")
    problem, variables = resume(fit, evidence, settings.kinematics)
    surfaces = [fit.scene.ground.friction, *(item.friction for item in fit.scene.items)]
    friction = np.array([surface.sliding for surface in surfaces])
    world = World(Masses.of(fit.body), fit.body.height_m, friction)
    for unit in ROUNDS:
        planned = Planned(problem, world.in_units(unit), WEIGHT)
        variables, _ = search.minimise(
            planned, partial(curvature, planned), variables, EVALUATIONS, shared=False
        )
    motion, found = planned.explained(variables.pack())
    return _reference(fit, planned, variables, motion, found)


def _reference(
    fit: KinematicFit, planned: Planned, variables: Variables, motion: Motion, found: Explained
) -> Reference:
    qpos = layout.to_qpos(variables.root_m, planned.problem.base, variables.rotvecs)
    forces = _every_frame(found.forces)  # (T, C, 3)
    size = np.linalg.norm(forces, axis=2) / (TOUCHES * planned.world.weight_N)
    return Reference(
        planner=NAME,
        times_s=fit.times_s,
        qpos=qpos,
        com_m=configurations(fit.body, qpos)[0],
        contact_names=contact_names(fit.body.primitives),
        contact=(np.tanh(size - 1.0) + 1.0) / 2.0,
        contact_parts=contact_parts(fit.body.primitives),
        contact_segments=tuple(fit.body.skeleton.names[row] for row in planned.problem.contacts.segments),
        contact_force_N=forces,
        contact_place_m=np.swapaxes(motion.touching_m, 0, 1),
        contact_apart_m=motion.apart_m.T,
        root_wrench=_at_root(_every_frame(found.residual * planned.world.sigma), motion),
    )


def _at_root(wrench: Array, motion: Motion) -> Array:
    """Force and moment (T, 6) about the centre of mass, about the root."""
    arm = motion.com_m - motion.state.variables.root_m
    moved = wrench.copy()
    moved[:, 3:] += np.cross(arm, wrench[:, :3])
    return moved


def _every_frame(values: Array) -> Array:
    """Values (T - 2, …) of the frames that have an acceleration, for all: the ends take their neighbours'."""
    return np.concatenate((values[:1], values, values[-1:]))


def contact_names(primitives: tuple[Primitive, ...]) -> tuple[str, ...]:
    """Names of the contact points of primitives (`kinematics.contacts`): the part's name, and a number."""
    return tuple(f"{part.name}_{number}" for part in primitives for number in range(_points(part)))


def contact_parts(primitives: tuple[Primitive, ...]) -> tuple[str, ...]:
    """The primitive of each contact point."""
    return tuple(part.name for part in primitives for _ in range(_points(part)))


def _points(part: Primitive) -> int:
    """Ends of a capsule, corners of a box."""
    return 2 if part.kind == "capsule" else 8


__all__ = ["contact_names", "contact_parts", "plan"]
