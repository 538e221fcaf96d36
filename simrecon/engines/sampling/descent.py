"""Gauss-Newton steps on rollouts: downhill from a start, with exact slopes (`jacobian`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.engines.sampling.jacobian import linearise
from simrecon.engines.sampling.task import Task
from simrecon.optim.gauss_newton import Quadratic
from simrecon.sim.rollout import Simulator
from simrecon.types import Array

DAMPINGS = np.logspace(-2, 2, 5)
"""Tried at a time, times the one of the last step."""
FIRST_DAMPING, RAISE = 0.1, 1e3
FAILURES = 2
"""Trials in a row without a step downhill after which there is none."""
REST = 0.01
"""Share of the loss: a step that gains less is the last one."""


@dataclass
class Descent:
    """A point of one window's search space that moves downhill.

    Attributes:
        x: (n,) best so far; loss: there; terms: of it, weighted, by name.
        quadratic: the loss around the last point where it was measured, in units of deviations; or None.
        evaluations: rollouts so far.
        damping: of the last step; gain: its share of the loss. failures: trials since then.
    """

    task: Task
    simulator: Simulator
    x: Array
    loss: float
    terms: dict[str, float]
    evaluations: int = 1
    quadratic: Quadratic | None = None
    damping: float = FIRST_DAMPING
    failures: int = 0
    gain: float = 1.0

    @classmethod
    def begin(cls, task: Task, simulator: Simulator, samples: Array) -> Descent:
        """At the best of unknowns (K, n)."""
        values, finite = task.evaluate(simulator, samples)
        total = np.where(finite, sum(values.values()), np.inf)
        best = int(np.argmin(total))
        terms = {name: float(value[best]) for name, value in values.items()} if finite[best] else {}
        return cls(task, simulator, samples[best], float(total[best]), terms, len(samples))

    @property
    def at_rest(self) -> bool:
        """Whether no further step is worth its cost, or possible."""
        return self.is_stuck or (not self.failures and self.gain < REST)

    @property
    def is_stuck(self) -> bool:
        """Whether no further step is possible."""
        return self.failures >= FAILURES or not np.isfinite(self.loss)

    def step(self) -> None:
        """Take the best of several damped steps, if one leads downhill; measure the slope where it is new."""
        if self.is_stuck:
            return
        scale = self.task.deviations()
        if self.quadratic is None or not self.failures:
            slopes = linearise(self.task, self.simulator, self.x, scale)
            self.quadratic = Quadratic(slopes.curvature, slopes.gradient)
            self.evaluations += 1
        dampings = (self.damping * DAMPINGS).tolist()
        steps = np.stack(self.simulator.each(self.quadratic.step, dampings)) * scale  # (L, n)
        low, high = self.task.bounds().T
        samples = np.clip(self.x + steps, low, high)
        values, finite = self.task.evaluate(self.simulator, samples)
        self.evaluations += len(samples)
        total = np.where(finite, sum(values.values()), np.inf)
        best = int(np.argmin(total))
        if not total[best] < self.loss:
            self.damping *= RAISE
            self.failures, self.gain = self.failures + 1, 0.0
            return
        self.gain, self.failures = 1.0 - float(total[best]) / self.loss, 0
        self.x, self.loss = samples[best], float(total[best])
        self.terms = {name: float(value[best]) for name, value in values.items()}
        self.damping *= float(DAMPINGS[best])
