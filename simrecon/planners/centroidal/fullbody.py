"""The full body that goes with a plan, by inverse kinematics (Rempe 2020, C.4), all frames at once.

    E = E_fit + Δt Σ_t (Σ ‖p - p̂‖² / σ_p² + ‖c - ĉ‖² / σ_c² + Σ ‖x - x̂‖² / σ_x² + Σ ‖v - v̄‖² / σ_v²)

with planned points p̂ and centre of mass ĉ, joints x̂ of the upper body as the input has them around its
centre of mass, turned with the plan, rotation vectors v̄ of the input, and of the kinematic objective E_fit
smoothness, joint limits and penetration.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from simrecon.kinematics import curvature as kinematic
from simrecon.kinematics import forward, layout, scaled, search, terms
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.hessian import Curvature
from simrecon.kinematics.jacobian import moved_by, of_points
from simrecon.kinematics.layout import FREE, JOINT_TURNS, Variables
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.supports import supports
from simrecon.plan import Kinematics
from simrecon.planners.centroidal.planned import Planned
from simrecon.planners.centroidal.settings import FullBody as Scales
from simrecon.types import Array, IntArray, KinematicFit

USED = ("smooth_position", "smooth_rotation", "limit", "penetration")
LEGS = ("left_hip", "right_hip")


@dataclass(frozen=True, eq=False)
class Goals:
    """What points of the body are held to, P points.

    Attributes:
        segments: (P,); offsets_m: (P, 3) in their frames.
        places_m: (P, T, 3); weights: (P,), 1 / m².
        com_m: (T, 3); com_weight: 1 / m².
        rotvecs: (SEGMENTS, T, 3); turn_weight: 1 / rad².
    """

    segments: IntArray
    offsets_m: Array
    places_m: Array
    weights: Array
    com_m: Array
    com_weight: float
    rotvecs: Array
    turn_weight: float


class Held:
    """Loss of a clip's variables; called with the packed vector it returns loss and gradient."""

    def __init__(self, problem: Problem, goals: Goals) -> None:
        self.problem, self.goals = problem, goals
        self._fit = Objective(problem)

    def __call__(self, x: Array) -> tuple[float, Array]:
        """Loss and gradient (n,) at packed variables x (n,)."""
        loss, gradient = self._fit(x)
        state, goals, dt = State(self.problem, self.problem.unpack(x)), self.goals, self.problem.dt
        places = forward.points(state.pose, goals.segments, goals.offsets_m)
        off = places - goals.places_m
        com = state.com_m - goals.com_m
        turned = state.variables.rotvecs[1:] - goals.rotvecs[1:]
        weights = goals.weights[:, None, None]
        loss += dt * float(
            np.sum(weights * off**2)
            + goals.com_weight * np.sum(com**2)
            + goals.turn_weight * np.sum(turned**2)
        )
        touch = self.problem.contacts
        segments = np.concatenate((goals.segments, touch.segments))
        points = np.concatenate((places, state.spheres_m))
        slopes = np.concatenate((weights * off, goals.com_weight * touch.mass_share[:, None, None] * com))
        force, turns = forward.adjoint(self.problem.skeleton, state.pose, segments, points, 2 * dt * slopes)
        turns[1:] += 2 * dt * goals.turn_weight * turned
        root, rotvecs, _ = layout.split(gradient, self.problem.frames)  # views
        root += force[0]
        rotvecs += turns
        return loss, gradient

    def curvature(self, variables: Variables) -> Iterator[Curvature]:
        """Its Hessian in the approximation of Gauss and Newton, one block of frames after the other."""
        start, turns = 0, np.arange(FREE)[JOINT_TURNS]
        for part in kinematic.curvature(self.problem, variables):
            own = slice(start, start + len(part.border))
            state = State(self.problem.part(own), variables.part(own))
            block = part.blocks[0].copy()
            block += 2 * self.problem.dt * self._gram(state)
            block[:, turns, turns] += 2 * self.problem.dt * self.goals.turn_weight
            yield replace(part, blocks=(block, part.blocks[1], part.blocks[2]))
            start = own.stop

    def _gram(self, state: State) -> Array:
        """Σ w Jᵀ J of points and centre of mass, (T, FREE, FREE)."""
        goals, touch, skeleton = self.goals, self.problem.contacts, self.problem.skeleton
        places = forward.points(state.pose, goals.segments, goals.offsets_m)
        moved = of_points(skeleton, state.pose, goals.segments, places)  # (T, P, 3, FREE)
        spheres = of_points(skeleton, state.pose, touch.segments, state.spheres_m)
        com = np.einsum("g,tgij->tij", touch.mass_share, spheres)[:, None]
        rows = np.concatenate(
            (np.sqrt(goals.weights)[:, None, None] * moved, np.sqrt(goals.com_weight) * com), axis=1
        )
        flat = rows.reshape(len(rows), -1, FREE)
        return np.asarray(np.swapaxes(flat, 1, 2) @ flat)


def full_body(fit: KinematicFit, planned: Planned, plan: Kinematics, scales: Scales) -> Array:
    """Configurations (T, nq) of a person who moves as planned.

    Args:
        fit: the input of the plan.
        planned: centre of mass, orientation and points.
        plan: weights of the kinematic terms.
        scales: of the goals.
    """
    problem, begin, goals = held(fit, planned, plan, scales)
    objective = Held(problem, goals)
    found, _ = search.minimise(
        objective, partial(Held.curvature, objective), begin, scales.evaluations, settled=1e-4, shared=False
    )
    return layout.to_qpos(found.root_m, problem.base, found.rotvecs)


def held(
    fit: KinematicFit, planned: Planned, plan: Kinematics, scales: Scales
) -> tuple[Problem, Variables, Goals]:
    """The problem, where its search begins, and what it is held to."""
    root, base, rotvecs = layout.from_qpos(fit.qpos)
    skeleton = fit.body.skeleton
    touch, interval = contact_points(skeleton, fit.body.primitives), float(fit.times_s[1] - fit.times_s[0])
    before = forward.forward(skeleton, root, base, rotvecs, 1.0)
    turn = planned.axes @ np.swapaxes(base, 1, 2)  # (T, 3, 3)

    def carried(points: Array) -> Array:
        return planned.com_m + forward.rotated(turn, points - planned.input_com_m)

    marks = carried(forward.points(before, skeleton.point_segments, skeleton.point_offsets_m))
    rest = supports(fit.scene, touch, before, interval)
    see = scaled.observations(skeleton, touch, marks, rest, fit.scene, 1.0, interval, plan)
    problem = Problem.of_clip(
        skeleton, touch, fit.scene, planned.axes, see, terms.only(plan, USED), lengths=False
    )
    legs = np.any(moved_by(skeleton)[[skeleton.names.index(name) for name in LEGS]], axis=0)  # (SEGMENTS,)
    upper = np.flatnonzero(~np.asarray(legs)[skeleton.point_segments])
    points = planned.points
    goals = Goals(
        np.concatenate(([point.segment for point in points], skeleton.point_segments[upper])).astype(
            np.int64
        ),
        np.concatenate(([point.offset_m for point in points], skeleton.point_offsets_m[upper])),
        np.concatenate((planned.places_m, marks[upper])),
        np.concatenate((np.full(len(points), scales.point_m**-2), np.full(len(upper), scales.joint_m**-2))),
        planned.com_m,
        scales.com_m**-2,
        rotvecs,
        scales.turn_rad**-2,
    )
    upright = np.zeros((problem.leans.shape[1], layout.LEAN))
    begin = Variables(carried(root[None])[0], rotvecs, 0.0, 0.0, np.zeros(0), upright)
    return problem, begin, goals
