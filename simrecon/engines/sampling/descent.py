"""Gauss-Newton steps on rollouts: a start for the sampling, and the shape of the loss around it.

The Jacobian comes from rollouts too, one for each unknown, moved by far more than rounding would ask for:
over such a distance contacts that begin or end show. A knot acts from its first step on only, so its rollout
begins there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from simrecon.engines.sampling.task import DIFFERENCES, Task
from simrecon.optim import gauss_newton
from simrecon.optim.gauss_newton import Quadratic
from simrecon.sim.rollout import Rollouts, Simulator
from simrecon.sim.state import simulate
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
        dampings = (self.damping * DAMPINGS).tolist()
        tried = np.stack(self.simulator.each(self.quadratic.step, dampings)) * scale  # (L, n)
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
        of each piece of rows, and of those before it, only the last columns meet. J is kept in single
        precision: the differences are good to three digits.
        """
        task, simulator = self.task, self.simulator
        state, ctrl = task.states(self.x[None])[0], task.control(self.x[None])[0]
        nominal = simulator.run(state, ctrl[None], task.at_steps)
        states = simulate(task.problem.model, state, ctrl[:-1])  # (N + 1, nstate)
        here = task.residuals(nominal)
        roots = [term.roots() for term in here]
        residual = gauss_newton.residuals(here, roots)[0]  # (F, K)
        first = task.started(np.arange(len(self.x)))  # (n,)
        order = np.argsort(first, kind="stable")
        self.evaluations += 2.0 + float(np.sum(1.0 - first / (len(ctrl) - 1)))
        jacobian = np.zeros((len(order), residual.size), np.float32)
        gradient, curvature = np.zeros(len(order)), np.zeros((len(order), len(order)))

        def columns(piece: slice) -> tuple[int, int]:
            """First frame on which the rows act, and first column of J there."""
            frame = _acted(task, first[order[piece.start]])
            return frame, frame * residual.shape[1]

        def measure(piece: slice) -> None:
            rows, (frame, column) = order[piece], columns(piece)
            moved = np.repeat(self.x[None], len(rows), axis=0)
            moved[np.arange(len(rows)), rows] += DIFFERENCE * scale[rows]
            start, since = first[rows[0]], max(frame - DIFFERENCES, 0)
            begun = states[start] if start else task.states(moved)
            rolled = simulator.run(begun, task.control(moved)[:, start:], task.at_steps[frame:] - start)
            found = gauss_newton.residuals(
                task.residuals(_joined(nominal, rolled, since, frame), since), roots
            )
            slope = (found[:, frame - since :] - residual[frame:]).reshape(len(rows), -1) / DIFFERENCE
            valid = rolled.finite & (np.abs(slope).max(axis=1, initial=0.0) < JACOBIAN_MAX)
            slope[~valid] = 0.0
            jacobian[piece, column:] = slope
            gradient[piece] = slope @ residual[frame:].ravel()

        def multiply(piece: slice) -> None:
            _, column = columns(piece)
            curvature[piece, : piece.stop] = jacobian[piece, column:] @ jacobian[: piece.stop, column:].T

        pieces = _pieces(first[order], simulator.population)
        simulator.each(measure, pieces)
        simulator.each(multiply, pieces[::-1])
        curvature = np.tril(curvature) + np.tril(curvature, -1).T
        back = np.argsort(order)
        return curvature[np.ix_(back, back)], gradient[back]


def _pieces(first: IntArray, most: int) -> list[slice]:
    """Rows in the order of their first steps (n,), cut so that all of a piece have the same one."""
    bounds = [0, *(np.flatnonzero(np.diff(first)) + 1).tolist(), len(first)]
    found = []
    for begin, end in itertools.pairwise(bounds):
        cuts = [*range(begin, end, most), end]
        found += [slice(*cut) for cut in itertools.pairwise(cuts)]
    return found


def _acted(task: Task, start: int) -> int:
    """First frame of the loss on which an unknown has acted that begins to act at a step."""
    return int(np.searchsorted(task.at_steps, start, side="right")) if start else 0


def _joined(nominal: Rollouts, rolled: Rollouts, since: int, frame: int) -> Rollouts:
    """Rollouts at the frames from `since` on: those before `frame`, where they begin, as the nominal one."""

    def join(before: Array, found: Array) -> Array:
        known = np.broadcast_to(before[:, since:frame], (len(found), frame - since, *before.shape[2:]))
        return np.concatenate((known, found), axis=1)

    return Rollouts(
        join(nominal.qpos, rolled.qpos),
        join(nominal.points_m, rolled.points_m),
        join(nominal.com_m, rolled.com_m),
        rolled.finite,
    )
