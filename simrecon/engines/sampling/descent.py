"""Gauss-Newton steps on rollouts: a start for the sampling, and the shape of the loss around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.engines.sampling.jacobian import linearise
from simrecon.engines.sampling.task import Task
from simrecon.optim.gauss_newton import Quadratic
from simrecon.sim.rollout import Simulator
from simrecon.types import Array

# Dampings tried at a time, times the last one's; full and half steps of each.
DAMPINGS, LENGTHS = np.logspace(-2, 2, 9), (1.0, 0.5)
FIRST_DAMPING, RAISE = 0.1, 30.0


@dataclass
class Descent:
    """A point of one window's search space that moves downhill.

    Attributes:
        x: (n,) best so far; loss: there; terms: of it, weighted, by name.
        quadratic: the loss around the last point where it was measured, in units of deviations; or None.
        evaluations: rollouts so far, parts of a window as parts.
        damping: of the last step.
    """

    task: Task
    simulator: Simulator
    x: Array
    loss: float
    terms: dict[str, float]
    evaluations: float = 1.0
    quadratic: Quadratic | None = None
    damping: float = FIRST_DAMPING

    @classmethod
    def begin(cls, task: Task, simulator: Simulator) -> Descent:
        """At the warm start."""
        x = task.warm_start()
        values, finite = task.evaluate(simulator, x[None])
        terms = {name: float(value[0]) for name, value in values.items()} if finite[0] else {}
        return cls(task, simulator, x, sum(terms.values()) if finite[0] else np.inf, terms)

    def step(self) -> bool:
        """Measure the Jacobian and try steps; whether one of them was downhill."""
        if not np.isfinite(self.loss):
            return False
        scale = self.task.deviations()
        slopes = linearise(self.task, self.simulator, self.x, scale)
        self.quadratic = Quadratic(slopes.curvature, slopes.gradient)
        self.evaluations += slopes.evaluations
        dampings = (self.damping * DAMPINGS).tolist()
        steps = np.stack(self.simulator.each(self.quadratic.step, dampings)) * scale  # (L, n)
        low, high = self.task.bounds().T
        samples = np.clip(np.concatenate([self.x + length * steps for length in LENGTHS]), low, high)
        values, finite = self.task.evaluate(self.simulator, samples)
        self.evaluations += len(samples)
        total = np.where(finite, sum(values.values()), np.inf)
        best = int(np.argmin(total))
        if not total[best] < self.loss:
            self.damping *= RAISE
            return False
        self.x, self.loss = samples[best], float(total[best])
        self.terms = {name: float(value[best]) for name, value in values.items()}
        self.damping *= float(DAMPINGS[best % len(DAMPINGS)])
        return True
