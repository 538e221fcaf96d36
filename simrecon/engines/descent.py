"""Gauss-Newton steps on rollouts: a start for the sampling, and the shape of the loss around it.

The Jacobian comes from rollouts too, one for each unknown, moved by far more than rounding would ask for:
over such a distance contacts that begin or end show. A knot acts from its first step on only, so its rollout
begins there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon import gauss_newton, rollout
from simrecon.engines.task import Task
from simrecon.gauss_newton import Quadratic
from simrecon.rollout import Rollouts, Simulator
from simrecon.types import Array

# Of the deviation in which an unknown is searched: 0.003 and 0.03 rad for knots were worse than 0.01.
DIFFERENCE = 0.15
# Dampings tried at a time, times the last one's; full and half steps of each.
DAMPINGS, LENGTHS = np.logspace(-2, 2, 9), (1.0, 0.5)
FIRST_DAMPING, RAISE = 0.1, 30.0
# A rollout that a small move throws this far off says nothing of the slope, in units of weighted residuals.
JACOBIAN_MAX = 1e4


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
        terms, finite = task.evaluate(simulator, x[None])
        loss = sum(float(value[0]) for value in terms.values()) if finite[0] else np.inf
        known = {name: float(value[0]) for name, value in terms.items()} if finite[0] else {}
        return cls(task, simulator, x, loss, known)

    def step(self) -> bool:
        """Measure the Jacobian and try steps; whether one of them was downhill."""
        if not np.isfinite(self.loss):
            return False
        scale = self.task.deviations()
        self.quadratic = Quadratic(*self._linearise(scale))
        tried = self.quadratic.steps(self.damping * DAMPINGS) * scale  # (L, n)
        low, high = self.task.bounds().T
        samples = np.clip(np.concatenate([self.x + length * tried for length in LENGTHS]), low, high)
        terms, finite = self.task.evaluate(self.simulator, samples)
        self.evaluations += len(samples)
        total = np.where(finite, sum(terms.values()), np.inf)
        best = int(np.argmin(total))
        if not total[best] < self.loss:
            self.damping *= RAISE
            return False
        self.x, self.loss = samples[best], float(total[best])
        self.terms = {name: float(value[best]) for name, value in terms.items()}
        self.damping *= float(DAMPINGS[best % len(DAMPINGS)])
        return True

    def _linearise(self, scale: Array) -> tuple[Array, Array]:
        """Jacobian (n, R) of the weighted residuals by forward differences, and the residuals (R,)."""
        task, simulator = self.task, self.simulator
        state, ctrl = task.states(self.x[None])[0], task.control(self.x[None])[0]
        states = rollout.replay(task.problem.model, state, ctrl[:-1])  # (N + 1, nstate)
        nominal = simulator.run(state, ctrl[None], task.at_steps)
        here = task.residuals(nominal)
        roots = [term.roots() for term in here]
        residual = gauss_newton.residuals(here, roots)[0]
        first = task.started(np.arange(len(self.x)))  # (n,)
        jacobian = np.zeros((len(self.x), len(residual)))
        self.evaluations += 2.0
        for start in np.unique(first):
            rows = np.flatnonzero(first == start)
            for piece in np.array_split(rows, -(-len(rows) // simulator.population)):
                moved = np.repeat(self.x[None], len(piece), axis=0)
                moved[np.arange(len(piece)), piece] += DIFFERENCE * scale[piece]
                begun = states[start] if start else task.states(moved)
                after = task.at_steps > start if start else task.at_steps >= 0
                rolled = simulator.run(begun, task.control(moved)[:, start:], task.at_steps[after] - start)
                self.evaluations += len(piece) * (1.0 - start / (len(ctrl) - 1))
                found = gauss_newton.residuals(task.residuals(_joined(nominal, rolled, after)), roots)
                slope = (found - residual) / DIFFERENCE
                valid = rolled.finite & (np.abs(slope).max(axis=1, initial=0.0) < JACOBIAN_MAX)
                jacobian[piece] = np.where(valid[:, None], slope, 0.0)
        return jacobian, residual


def _joined(nominal: Rollouts, rolled: Rollouts, after: NDArray[np.bool_]) -> Rollouts:
    """Rollouts at all frames: those before `after` (F,) as the nominal one."""

    def join(before: Array, found: Array) -> Array:
        whole = np.repeat(before, len(found), axis=0)
        whole[:, after] = found
        return whole

    return Rollouts(
        join(nominal.qpos, rolled.qpos),
        join(nominal.points_m, rolled.points_m),
        join(nominal.com_m, rolled.com_m),
        rolled.finite,
    )
