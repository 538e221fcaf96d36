"""The problem of a fit that has ended, at its end: from here a planner goes on with the same evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import trust
from simrecon.kinematics import layout, terms, wishing, world
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.observe import by_point, observe, size
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.unscaled import Unscaled, unscaled
from simrecon.optim import lbfgs
from simrecon.plan import Kinematics
from simrecon.types import Array, Evidence, KinematicFit

LEAN_EVALUATIONS = 50
SIZE_SIGMA = 1.0
"""Of the stature, where it does not move (natural logarithm)."""


def resume(
    fit: KinematicFit, evidence: Evidence, plan: Kinematics, *, lengths: bool = False
) -> tuple[Problem, Variables]:
    """The problem that a fit solved, on the body that it found, and its solution.

    Args:
        fit: that has ended.
        evidence: that it was made from, on the same frames.
        plan: weights and scales.
        lengths: whether size and lengths are unknowns, as they were of the fit; without effect where the body
            isn't one of the evidence's lengths.

    Raises:
        InputError: nothing in the evidence can be used.
    """
    worth = trust.of(evidence)
    measured = unscaled(fit, evidence, plan, worth)
    own = measured if lengths else None
    if own is None:
        own = Unscaled(fit.body.skeleton, fit.body.primitives, SIZE_SIGMA, 0.0, 0.0, np.zeros(0))
    skeleton, plan = own.skeleton, terms.switched(trust.weighed(plan, worth))
    points, camera = by_point(evidence, skeleton), world.provisional(evidence)
    see = observe(evidence, skeleton, points, camera, plan, worth, own.size_sigma)
    if measured is not None and not see.metric:
        # lengths that the fit moved don't change how large it took the 3D estimate to be
        large = size(evidence, measured.skeleton) * np.exp(measured.log_scale - own.log_scale)
        see = replace(see, joints_m=see.joints_m * (large / size(evidence, skeleton)))
    see = world.observed(see, fit.world, fit.camera)
    root, base, rotvecs = layout.from_qpos(fit.qpos)
    free, rolling = len(own.lengths) > 0, plan.soles == "rolling"
    contacts = contact_points(skeleton, own.primitives, rolling=rolling)
    problem = Problem.of_clip(skeleton, contacts, fit.scene, base, see, plan, lengths=free)
    upright = np.zeros((problem.leans.shape[1], layout.LEAN))
    variables = Variables(root, rotvecs, own.log_scale, own.sole_m, own.lengths, upright)
    if fit.wished is not None:
        problem = wishing.asked(problem, variables, fit.wished)
    return problem, replace(variables, lean=_lean(problem, variables))


def _lean(problem: Problem, variables: Variables) -> Array:
    """How the 3D estimate leans against a body that stays as it is, (F, 3)."""
    objective = Objective(problem)

    def loss(lean: Array) -> tuple[float, Array]:
        x = replace(variables, lean=lean.reshape(variables.lean.shape)).pack()
        value, slope = objective(x)
        return value, slope[-lean.size :]

    end = lbfgs.minimize(loss, variables.lean.ravel(), max_evaluations=LEAN_EVALUATIONS, ftol_rel=1e-6)
    return end.x.reshape(variables.lean.shape)
