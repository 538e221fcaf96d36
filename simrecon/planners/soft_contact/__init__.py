"""The planner `soft_contact`: the laws of motion enter the estimate before the simulation (Xie et al. 2021).

masses      the person as point masses
asked       what a user wishes of the contacts, as forces
forces      the forces of a scene that explain a wrench best
physics     what moves the body, and what pushing costs
scales      units of that, and what a force costs at least
objective   both with the evidence terms of the kinematic fit
steady      what keeps its forces smooth, and its place the fit's
curvature   of all that, for the search
person      the person's size and lengths, where a plan moves them
nodes       poses on splines, where a plan asks for them
spline_conditioning
            the variables of the search over these
stages      the search

It goes on where the kinematic fit has ended, with the same evidence and search.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon.io.messages import counted
from simrecon.kinematics import configurations, layout
from simrecon.kinematics.layout import Variables
from simrecon.plan import Plan
from simrecon.planners import none
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.objective import Planned
from simrecon.planners.soft_contact.physics import Motion
from simrecon.planners.soft_contact.stages import searched
from simrecon.system import blas
from simrecon.types import Array, Evidence, KinematicFit, Primitive, Reference

NAME = "soft_contact"
FEWEST = 3
"""Frames that have an acceleration between them."""
OWN = "world,joints_m=0.05,place_m=0.05"
"""What a fit's own landmarks are worth: a few centimetres close feet and bend what no force explains. With
the scales of a network's estimate the root of the example on a smaller body moved by 5 cm, with these by 2,
while more of the force came from a distance (18 % of the weight instead of 7)."""
STAYS = "lengths stay as they are: the body is not one of lengths that were measured in the evidence"
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
    lengths = settings.soft_contact.lengths and settings.kinematics.shape and not own
    planned, variables, body = searched(placed, seen, settings, lengths=lengths)
    motion, found = planned.explained(variables.pack())
    fit = fit if body is None else replace(fit, body=body)
    reference = _reference(fit, planned, variables, motion, found)
    notes = (STAYS,) if settings.soft_contact.lengths and body is None else ()
    return replace(reference, body=body, notes=notes)


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
