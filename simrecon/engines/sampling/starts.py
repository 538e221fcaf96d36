"""Several descents of one window from different starts; the steps go to those that promise most.

Exact slopes lead to the bottom of the contact mode in which they begin; the start decides which that is.
Steps that are left when no descent promises more go to new starts beside the best one.
"""

from __future__ import annotations

import numpy as np

from simrecon.engines.sampling.course import Course
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.task import Task
from simrecon.sim.rollout import Simulator
from simrecon.types import Array

NOISE = (0.3, 1.0)
"""Of the starts beside the warm one, in turn, in deviations (docs/studies/derivatives.md)."""
DRAWS = 16
"""Points that are drawn for a start with noise; it begins at the best of them."""
RISE = 0.3
"""Mean rise of the loss, as a share of it, over draws about the best point where all descents are at rest."""
FIRST_STEPS = 2
"""Of every start, before they are compared."""
AHEAD = 3
"""Steps over which a descent is trusted to go on gaining what its last one gained."""
PATIENCE = 6
"""Steps over which the best loss is looked at, to tell whether it is at rest."""


def descend(
    task: Task, simulator: Simulator, rng: np.random.Generator, count: int, steps: int, course: Course
) -> Descent:
    """The best of some starts, after so many steps of all together.

    Args:
        task: the window.
        simulator: rolls out.
        rng: the noise of the starts.
        count: of them; one is enough if no step is taken.
        steps: of all together; those that find no way down count.
        course: gets an entry for the start and each step.
    """
    descents = [Descent.begin(task, simulator, x) for x in starts(task, count if steps else 1, rng)]
    course.add(min(descent.loss for descent in descents), simulator.steps)
    first = [descent for descent in descents for _ in range(FIRST_STEPS)]
    for step in range(steps):
        descent = first[step] if step < len(first) else most_promising(descents)
        if descent is None:
            best = lowest(descents)
            if not np.isfinite(best.loss):
                break
            descent = Descent.begin(task, simulator, around(best, rng))
            descents.append(descent)
        descent.step()
        course.add(descent.loss, simulator.steps)
        if step >= len(first) and course.at_rest(task.problem.plan.optimiser, PATIENCE):
            break
    course.evaluations = sum(descent.evaluations for descent in descents)
    return lowest(descents)


def lowest(descents: list[Descent]) -> Descent:
    """The one with the lowest loss."""
    return min(descents, key=lambda descent: descent.loss)


def starts(task: Task, count: int, rng: np.random.Generator) -> list[Array]:
    """Unknowns (K, n) to begin at the best of: the warm start, and so many times draws beside it."""
    warm = task.warm_start()
    size = DRAWS, len(warm)
    noisy = (
        within(task, warm + NOISE[k % len(NOISE)] * task.deviations() * rng.standard_normal(size))
        for k in range(count - 1)
    )
    return [warm[None], *noisy]


def around(descent: Descent, rng: np.random.Generator) -> Array:
    """Draws (DRAWS, n) about the end of a descent, wide where the loss is flat."""
    moves = rng.standard_normal((DRAWS, len(descent.x)))
    if descent.quadratic is not None:
        moves = moves @ descent.quadratic.root_covariance(RISE * descent.loss, 1.0)
    return within(descent.task, descent.x + moves * descent.task.deviations())


def within(task: Task, x: Array) -> Array:
    """Unknowns (..., n) within their bounds."""
    low, high = task.bounds().T
    return np.clip(x, low, high)


def most_promising(descents: list[Descent]) -> Descent | None:
    """The lowest one if all went on as in their last steps; None if none would be below the best."""
    best = min(descent.loss for descent in descents)
    able = [descent for descent in descents if not descent.at_rest]
    promised = {id(descent): descent.loss * (1.0 - descent.gain) ** AHEAD for descent in able}
    able = [descent for descent in able if promised[id(descent)] < best or descent.loss == best]
    return min(able, key=lambda descent: promised[id(descent)], default=None)
