"""A fit that has ended, bent to what a user wishes of its contacts."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from simrecon.contact import honoured, wishes
from simrecon.kinematics import search
from simrecon.kinematics.curvature import curvature
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.types import Array, ContactTargets


def honour(problem: Problem, variables: Variables, targets: ContactTargets) -> tuple[Problem, Variables, int]:
    """Go on from a fit with wishes in its objective; what all frames share, and the floor, stay as they are.

    Wishes that cannot hold are left out: a part that the evidence has far from everything.

    Args:
        problem: that was solved.
        variables: its solution.
        targets: wishes.

    Returns:
        The problem with the wishes that can hold, its solution, and the evaluations that it took.
    """
    wished = asked(problem, variables, targets)
    possible = wished.observations.targets
    if possible is None or not (possible.touch | possible.free).any():
        return wished, variables, 0
    evaluations = problem.plan.evaluations if problem.plan.poses else 0
    variables, used = search.minimise(
        Objective(wished), partial(curvature, wished), variables, evaluations, settled=1e-4, shared=False
    )
    return wished, variables, used


def asked(problem: Problem, variables: Variables, targets: ContactTargets) -> Problem:
    """A problem with those wishes in its objective that can hold where its variables put the person."""
    see, possible = problem.observations, honoured.possible(targets, _clearance_m(problem, variables))
    labels = wishes.over(see.labels, possible)
    return replace(problem, observations=replace(see, labels=labels, targets=possible))


def _clearance_m(problem: Problem, variables: Variables) -> Array:
    """Distance of each part from what is nearest, (T, P)."""
    least, _ = State(problem, variables).nearest
    return np.stack([least[rows].min(axis=0) for rows in problem.contacts.parts], axis=1)
