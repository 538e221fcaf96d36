"""Gauss-Newton steps on rollouts: a start for the sampling, and the shape of the loss around it.

The Jacobian comes from rollouts too, one for each unknown, moved by far more than rounding would ask for:
over such a distance contacts that begin or end show. A knot acts from its first step on only, so its rollout
begins there.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon import gauss_newton, rollout
from simrecon.engines.task import Task
from simrecon.gauss_newton import Quadratic
from simrecon.rollout import Rollouts, Simulator
from simrecon.types import Array, IntArray

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
        """J Jᵀ (n, n) and J r (n,) of the weighted residuals r (R,), J (n, R) by forward differences.

        Residuals lie in the order of their frames, and an unknown acts on those after its first step only. So
        of each piece of rows, and of those before it, only the last columns meet. The simulator rolls out the
        next piece meanwhile.
        """
        task, simulator = self.task, self.simulator
        state, ctrl = task.states(self.x[None])[0], task.control(self.x[None])[0]
        states = rollout.replay(task.problem.model, state, ctrl[:-1])  # (N + 1, nstate)
        nominal = simulator.run(state, ctrl[None], task.at_steps)
        here = task.residuals(nominal)
        roots = [term.roots() for term in here]
        residual = gauss_newton.residuals(here, roots)[0]  # (F, K)
        first = task.started(np.arange(len(self.x)))  # (n,)
        order = np.argsort(first, kind="stable")
        self.evaluations += 2.0 + float(np.sum(1.0 - first / (len(ctrl) - 1)))
        jacobian, curvature = np.zeros((len(order), residual.size)), np.zeros((len(order), len(order)))

        def roll(rows: IntArray) -> Rollouts:
            start = first[rows[0]]
            moved = np.repeat(self.x[None], len(rows), axis=0)
            moved[np.arange(len(rows)), rows] += DIFFERENCE * scale[rows]
            begun = states[start] if start else task.states(moved)
            after = task.at_steps[_acted(task, start)]
            return simulator.run(begun, task.control(moved)[:, start:], after - start)

        pieces, end = _pieces(order, first, simulator.population), 0
        with ThreadPoolExecutor(1) as ahead:
            for rows, rolled in zip(pieces, ahead.map(roll, pieces), strict=True):
                after = _acted(task, first[rows[0]])
                begin, end = end, end + len(rows)
                column = int(np.argmax(after)) * residual.shape[1]
                found = gauss_newton.residuals(task.residuals(_joined(nominal, rolled, after)), roots)
                slope = (found.reshape(len(rows), -1) - residual.ravel())[:, column:] / DIFFERENCE
                valid = rolled.finite & (np.abs(slope).max(axis=1, initial=0.0) < JACOBIAN_MAX)
                jacobian[begin:end, column:] = np.where(valid[:, None], slope, 0.0)
                curvature[begin:end, :end] = jacobian[begin:end, column:] @ jacobian[:end, column:].T
        curvature = np.tril(curvature) + np.tril(curvature, -1).T
        back = np.argsort(order)
        return curvature[np.ix_(back, back)], (jacobian @ residual.ravel())[back]


def _pieces(order: IntArray, first: IntArray, most: int) -> list[IntArray]:
    """Rows in their order, cut so that those of a piece have one first step, and are at most so many."""
    groups = np.split(order, np.flatnonzero(np.diff(first[order])) + 1)
    return [piece for group in groups for piece in np.array_split(group, -(-len(group) // most))]


def _acted(task: Task, start: int) -> NDArray[np.bool_]:
    """Frames (F,) of the loss on which an unknown has acted that begins to act at a step."""
    return task.at_steps > start if start else task.at_steps >= 0


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
