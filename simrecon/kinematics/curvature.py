"""The Hessian of the kinematic objective in the approximation of Gauss and Newton, for `conditioning`.

Robust terms count with their weight at the point where it is taken. Terms that the search can do without are
left out or simplified: an exact Hessian is not needed. It is taken in blocks of frames, as all of it at once
would be gigabytes of a long clip.
"""

from __future__ import annotations

from collections.abc import Iterator

from simrecon.kinematics.bands import REACH
from simrecon.kinematics.hessian import Curvature, Hessian
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.terms import TERMS

BLOCK = 64
"""Frames of which the curvature is taken at once."""


def curvature(problem: Problem, variables: Variables) -> Iterator[Curvature]:
    """Curvature of the objective at the variables, one block of frames after the other.

    The first one has the priors on what all frames share.
    """
    for start in range(0, problem.frames, BLOCK):
        stop = min(start + BLOCK, problem.frames)
        near = slice(max(start - REACH, 0), stop + REACH)
        part = problem.part(near)
        hessian = Hessian(State(part, variables.part(near)))
        for term in TERMS:
            weight = term.weight(problem.plan)
            if weight and term.applies(part) and (term.per_frame or start == 0):
                term.curvature(hessian.state, hessian, weight)
        yield hessian.by_variables(slice(start - near.start, stop - near.start))
