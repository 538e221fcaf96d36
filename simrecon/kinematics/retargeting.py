"""A fitted motion on another body (Rempe 2020, appendix D).

The landmarks of the motion, uniformly scaled to the size of the other body, are what its joint angles are
solved for, and what touched floor or items before touches them again and does not slide (eq. B6, B7). The
solver is that of the kinematic fit: all frames at once, L-BFGS, analytic gradients.

Size is that of the legs. On bare ground the way that the person goes scales too. Items of a scene don't
scale with a person, so among them the way is kept, and heights scale from what the person stands on.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from simrecon.body import known
from simrecon.kinematics import forward, scaled, search, terms
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.layout import FREE, LEAN, Variables, from_qpos, to_qpos
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.result import configurations
from simrecon.kinematics.state import State
from simrecon.kinematics.supports import Supports, supports
from simrecon.kinematics.terms.kept import Hold, Touch, Turn
from simrecon.kinematics.touched import labels, touched
from simrecon.plan import Kinematics
from simrecon.system import blas
from simrecon.types import Array, Body, KinematicFit

# The motion before has met the other terms; they would only move it once more.
USED = ("joint", "place", "smooth_position", "smooth_rotation", "penetration", "limit")
# The scaled way is no estimate, so it counts for more than the place of evidence does.
PLACE_SCALE_M = 0.03


@blas.one_thread()
def retarget(fit: KinematicFit, body: Body, plan: Kinematics) -> KinematicFit:
    """Put a motion on another body.

    Args:
        fit: the motion, on uniform frames.
        body: the other body.
        plan: weights of the objective; evidence has no share in it.

    Returns:
        The motion of `body`, in the same scene and world; reprojection errors are NaN.
    """
    objective, begin = retargeting(fit, body, plan)
    variables, used = search.minimise(
        objective,
        partial(curvature, objective.problem),  # without the terms of the contacts
        begin,
        plan.evaluations,
        settled=1e-4,
        shared=False,
    )
    objective(variables.pack())
    qpos = to_qpos(variables.root_m, objective.problem.base, variables.rotvecs)
    return replace(
        fit,
        body=body,
        qpos=qpos,
        com_m=configurations(body, qpos)[0],
        reprojection_px=np.full_like(fit.reprojection_px, np.nan),
        iterations=used,
        loss=objective.losses,
        contacts=labels(touched(body, fit.scene, qpos, fit.times_s), None, None),
        wished=None,
    )


def scale_of(fit: KinematicFit, body: Body) -> float:
    """Factor by which a motion is scaled for another body: the ratio of leg lengths."""
    return known.leg_m(body.skeleton) / known.leg_m(fit.body.skeleton)


class Retargeting:
    """Objective of a motion on another body; called with the packed variables, it returns loss and gradient.

    E = E_fit + Δt Σ_t (Σ a (d - d̂)² / σ_d² + Σ b ‖ẋ‖² / σ_v² + Σ ‖v - v̂‖² / σ_r²) with the kinematic
    objective E_fit of scaled landmarks, clearances d of what touches (weights a), velocities ẋ of contact
    points at rest (b), and rotation vectors v. Scale, sole and lengths of the body don't move.
    """

    def __init__(self, problem: Problem, before: Supports, scale: float, rotvecs: Array) -> None:
        """Hold the problem; `before` and `rotvecs` (SEGMENTS, T, 3) are those of the motion before."""
        self.problem = problem
        self.losses: dict[str, float] = {}
        near = scale * np.maximum(before.clearance_m, 0.0)  # as near as before, never inside
        self._fit = Objective(problem)
        self._kept = (Touch(near, before.touching), Hold(before.held), Turn(rotvecs))

    def __call__(self, x: Array) -> tuple[float, Array]:
        """Loss and gradient (n,) at the packed variables x (n,)."""
        loss, gradient = self._fit(x)
        state, dt = State(self.problem, self.problem.unpack(x)), self.problem.dt
        slopes = Gradient(state)
        kept = {term.name: dt * term.loss(state, slopes, 1.0) for term in self._kept}
        self.losses = {**self._fit.losses, **kept}
        own = FREE * self.problem.frames
        gradient[:own] += dt * slopes.packed()[:own]
        gradient[own:] = 0.0
        return loss + sum(kept.values()), gradient


def retargeting(fit: KinematicFit, body: Body, plan: Kinematics) -> tuple[Retargeting, Variables]:
    """The objective of `retarget`, and the scaled motion with the joint angles of before."""
    root, base, rotvecs = from_qpos(fit.qpos)
    before = fit.body.skeleton
    pose = forward.forward(before, root, base, rotvecs, 1.0)
    marks = forward.points(pose, before.point_segments, before.point_offsets_m)  # (M, T, 3)
    interval_s = float(fit.times_s[1] - fit.times_s[0])
    rest = supports(fit.scene, contact_points(before, fit.body.primitives), pose, interval_s)
    scale = scale_of(fit, body)
    touch = contact_points(body.skeleton, body.primitives)
    see = scaled.observations(body.skeleton, touch, marks, rest, fit.scene, scale, interval_s, plan)
    place = scaled.places(fit.scene, root, rest.height_m, scale)
    used = replace(terms.only(plan, USED), place_scale_m=PLACE_SCALE_M)
    problem = Problem.of_clip(body.skeleton, touch, fit.scene, base, see, used)
    upright = np.zeros((problem.leans.shape[1], LEAN))
    begin = Variables(place, rotvecs, 0.0, 0.0, np.zeros(len(problem.stretch)), upright)
    return Retargeting(problem, rest, scale, rotvecs), begin
