"""The problem of a fit that has ended, at its end: from here a planner goes on with the same evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import trust
from simrecon.kinematics import layout, terms, wishing, world
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.observe import by_point, observe
from simrecon.kinematics.problem import Problem
from simrecon.optim import lbfgs
from simrecon.plan import Kinematics
from simrecon.types import Array, Evidence, KinematicFit

LEAN_EVALUATIONS = 50
SIZE_SIGMA = 1.0
"""Of the stature, which does not move here (natural logarithm)."""


def resume(fit: KinematicFit, evidence: Evidence, plan: Kinematics) -> tuple[Problem, Variables]:
    """The problem that a fit solved, on the body that it found, and its solution.

    Args:
        fit: that has ended.
        evidence: that it was made from, on the same frames.
        plan: weights and scales.

    Raises:
        InputError: nothing in the evidence can be used.
    """
    worth, skeleton = trust.of(evidence), fit.body.skeleton
    plan = terms.switched(trust.weighed(plan, worth))
    points, camera = by_point(evidence, skeleton), world.provisional(evidence)
    see = observe(evidence, skeleton, points, camera, plan, worth, SIZE_SIGMA)
    see = world.observed(see, fit.world, fit.camera)
    root, base, rotvecs = layout.from_qpos(fit.qpos)
    contacts = contact_points(skeleton, fit.body.primitives)
    problem = Problem.of_clip(skeleton, contacts, fit.scene, base, see, plan, lengths=False)
    upright = np.zeros((problem.leans.shape[1], layout.LEAN))
    variables = Variables(root, rotvecs, 0.0, 0.0, np.zeros(0), upright)
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
