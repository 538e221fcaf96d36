"""The planner `soft_contact`: the laws of motion enter the estimate before the simulation (Xie et al. 2021).

masses      the person as point masses
asked       what a user wishes of the contacts, as forces
forces      the forces of a scene that explain a wrench best
physics     what moves the body, and what pushing costs
objective   both with the evidence terms of the kinematic fit
steady      what keeps its forces smooth, and its place the fit's
curvature   of all that, for the search

It goes on where the kinematic fit has ended, with the same unknowns, evidence and search, in rounds with ever
finer units of force and moment.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from simrecon.io.messages import counted
from simrecon.kinematics import configurations, layout, search
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.resumed import resume
from simrecon.plan import Plan
from simrecon.planners import none
from simrecon.planners.soft_contact.asked import asked as wished
from simrecon.planners.soft_contact.curvature import curvature
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.masses import Masses
from simrecon.planners.soft_contact.objective import Planned
from simrecon.planners.soft_contact.physics import Motion, Scales, World
from simrecon.system import blas
from simrecon.types import Array, Evidence, KinematicFit, Primitive, Reference

NAME = "soft_contact"
FEWEST = 3
"""Frames that have an acceleration between them."""
OWN = "world,joints_m=0.05,place_m=0.05"
"""What a fit's own landmarks are worth: a few centimetres close feet and bend what no force explains. With
the scales of a network's estimate the root of the example on a smaller body moved by 5 cm, with these by 2,
while more of the force came from a distance (18 % of the weight instead of 7)."""
TOUCHES = 0.02
"""Force, as a share of body weight, at which a contact counts as half closed (eq. 5)."""


@blas.one_thread()
def plan(fit: KinematicFit, evidence: Evidence, settings: Plan) -> Reference:
    """A motion near the evidence that the scene's forces explain, and these forces.

    Args:
        fit: the kinematic half.
        evidence: on the frames of the fit; where it names no point, as of a motion on another body, the fit's
            own landmarks stand for it.
        settings: weights of the evidence terms, and the section `soft_contact`.

    Raises:
        InputError: there is no evidence to plan with.
    """
    if len(fit.times_s) < FEWEST:
        count = counted(len(fit.times_s), "frame")
        note = f"{count} have no acceleration, which takes {FEWEST}: the plan is the kinematic fit"
        return replace(none.plan(fit, evidence, settings), notes=(note,))
    own = not evidence.keypoint_names and not evidence.joint_names
    placed, seen = (replace(fit, world=np.eye(4)), own_landmarks(fit, evidence)) if own else (fit, evidence)
    problem, variables = resume(placed, seen, settings.kinematics)
    surfaces = [fit.scene.ground.friction, *(item.friction for item in fit.scene.items)]
    friction = np.array([surface.sliding for surface in surfaces])
    asked = settings.soft_contact
    scales = Scales(
        distance_m=asked.distance_m,
        slip_mps=asked.slip_mps,
        rest=asked.rest,
        rate_per_s=asked.rate_per_s,
        place_m=asked.place_m,
    )
    world = World(Masses.of(fit.body), fit.body.height_m, friction, scales)
    world = replace(world, asked=wished(problem, variables, world.weight_N))
    for unit in asked.units:
        planned = Planned(problem, world.in_units(unit), asked.weight, fit.com_m)
        curved = partial(curvature, planned)
        variables, _ = search.minimise(planned, curved, variables, asked.evaluations, shared=False)
    motion, found = planned.explained(variables.pack())
    return _reference(fit, planned, variables, motion, found)


def own_landmarks(fit: KinematicFit, evidence: Evidence) -> Evidence:
    """The landmarks of a fit as its evidence, where nothing else is known: of a motion on another body."""
    return replace(
        evidence,
        joint_names=fit.body.skeleton.point_names,
        joints_m=configurations(fit.body, fit.qpos)[1],
        joints_frame="world",
        trust=OWN,
    )


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
