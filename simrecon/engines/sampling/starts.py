"""Several descents of one window from different starts; the steps go to those that promise most.

Exact slopes lead to the bottom of the contact mode in which they begin; the start decides which that is.
Steps that are left when no descent promises more go to new starts beside the best one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.task import Task
from simrecon.sim.rollout import Simulator
from simrecon.types import Array

NOISE = (0.3, 1.0)
"""Of the starts beside the warm one, in turn, in deviations (docs/studies/derivatives.md)."""
AGAIN = 0.3
"""Noise about the best point where all descents are at rest, in deviations; 0.15 left more of the loss."""
FIRST_STEPS = 2
"""Of every start, before they are compared."""
AHEAD = 3
"""Steps over which a descent is trusted to go on gaining what its last one gained."""


@dataclass
class Course:
    """How the best loss of a window went: at the start and after each step.

    Attributes:
        losses: best so far. steps: simulation steps spent until then.
        evaluations: rollouts in all.
    """

    losses: list[float] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    evaluations: int = 0

    def add(self, loss: float, steps: int) -> None:
        """One more entry."""
        self.losses.append(min([loss, *self.losses[-1:]]))
        self.steps.append(steps)


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
            best = min(descents, key=lambda own: own.loss)
            if not np.isfinite(best.loss):
                break
            descent = Descent.begin(task, simulator, beside(task, best.x, AGAIN, rng))
            descents.append(descent)
        descent.step()
        course.add(descent.loss, simulator.steps)
    course.evaluations = sum(descent.evaluations for descent in descents)
    return min(descents, key=lambda descent: descent.loss)


def starts(task: Task, count: int, rng: np.random.Generator) -> list[Array]:
    """Unknowns (n,) to begin with: the warm start, and so many more with noise."""
    warm = task.warm_start()
    return [warm, *(beside(task, warm, NOISE[k % len(NOISE)], rng) for k in range(count - 1))]


def beside(task: Task, x: Array, noise: float, rng: np.random.Generator) -> Array:
    """Unknowns (n,) with noise, in deviations, about x (n,), within their bounds."""
    low, high = task.bounds().T
    return np.clip(x + noise * task.deviations() * rng.standard_normal(len(x)), low, high)


def most_promising(descents: list[Descent]) -> Descent | None:
    """The lowest one if all went on as in their last steps; None if none would be below the best."""
    best = min(descent.loss for descent in descents)
    able = [descent for descent in descents if not descent.at_rest]
    promised = {id(descent): descent.loss * (1.0 - descent.gain) ** AHEAD for descent in able}
    able = [descent for descent in able if promised[id(descent)] < best or descent.loss == best]
    return min(able, key=lambda descent: promised[id(descent)], default=None)
