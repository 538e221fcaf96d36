"""The kinematic objective of a whole clip: the sum of its terms, with the analytic gradient."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics import layout
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.terms import TERMS
from simrecon.types import Array

# Frames whose loss is taken at once, which bounds memory, and frames on which a term reaches, but for one.
BLOCK, OVERLAP = 600, 2


class Objective:
    """Loss of a clip's kinematic variables; called with the packed vector it returns loss and gradient.

    Attributes:
        problem: what is to be solved.
        losses: each term's share of the loss, by name, at the point of the last call.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.losses: dict[str, float] = {}

    def __call__(self, x: Array, state: State | None = None) -> tuple[float, Array]:
        """Loss and gradient, (n,), at the packed variables x (n,), whose state may be known.

        A term is of one frame, or of up to three in a row, or a prior. So the loss of a long clip is that of
        blocks which overlap by two frames, less that of the overlaps.
        """
        frames, variables = self.problem.frames, self.problem.unpack(x)
        if frames <= BLOCK + OVERLAP:
            self.losses, gradient = evaluate(state or State(self.problem, variables))
            return sum(self.losses.values()), gradient
        loss, gradient, self.losses = 0.0, np.zeros_like(x), {}
        root, rotvecs, shared = layout.split(gradient, frames)  # views
        starts = range(0, frames - OVERLAP, BLOCK)
        blocks = [(1.0, slice(start, start + BLOCK + OVERLAP)) for start in starts]
        overlaps = [(-1.0, slice(start, start + OVERLAP)) for start in starts[1:]]
        for sign, rows in blocks + overlaps:
            part = self.problem.part(rows)
            losses, slope = evaluate(State(part, variables.part(rows)))
            d_root, d_rotvecs, d_shared = layout.split(slope, part.frames)
            root[rows] += sign * d_root
            rotvecs[:, rows] += sign * d_rotvecs
            shared += sign * d_shared
            loss += sign * sum(losses.values())
            self.losses.update(
                {name: self.losses.get(name, 0.0) + sign * value for name, value in losses.items()}
            )
        return loss, gradient


def evaluate(state: State) -> tuple[dict[str, float], Array]:
    """Losses by term, and the gradient of their sum by the packed variables, (n,); all frames at once."""
    problem = state.problem
    gradient, losses = Gradient(state), dict[str, float]()
    for term in TERMS:
        if not term.applies(problem):
            continue
        unit = term.unit(problem)
        if unit:
            losses[term.name] = term.loss(state, gradient, unit)
        elif term.listed:
            losses[term.name] = 0.0
    return losses, gradient.packed()
