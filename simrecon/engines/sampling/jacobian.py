"""The slope of the loss around a point of the search space, from rollouts: J Jᵀ and J r of its residuals.

There is one rollout for each unknown, moved by far more than rounding would ask for: over such a distance
contacts that begin or end show. A knot acts from its first step on only, so its rollout begins there.
Residuals lie in the order of their frames, so of each piece of rows of J, and of those before it, only the
last columns meet.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from simrecon.engines.sampling.task import Task
from simrecon.engines.sampling.terms import DIFFERENCES
from simrecon.optim import gauss_newton
from simrecon.sim.rollout import Rollouts, Simulator
from simrecon.sim.state import simulate
from simrecon.types import Array, IntArray

# Of the deviation in which an unknown is searched: 0.003 and 0.03 rad for knots were worse than 0.01.
DIFFERENCE = 0.15
# A rollout that a small move throws this far off says nothing of the slope, in units of weighted residuals.
JACOBIAN_MAX = 1e4


@dataclass(frozen=True, eq=False)
class Linearised:
    """The weighted residuals r (R,) near a point, with J (n, R) their derivatives in units of deviations.

    Attributes:
        curvature: (n, n) J Jᵀ. gradient: (n,) J r.
        evaluations: rollouts that it took, parts of a window as parts.
    """

    curvature: Array
    gradient: Array
    evaluations: float


def linearise(task: Task, simulator: Simulator, x: Array, scale: Array) -> Linearised:
    """Measure the slopes of a window's residuals by forward differences.

    Args:
        task: the window.
        simulator: rolls out, on all its threads.
        x: (n,) unknowns.
        scale: (n,) their deviations.
    """
    jacobian = _Jacobian(task, simulator, x, scale)
    pieces = _pieces(jacobian.first, simulator.population)
    simulator.each(jacobian.measure, pieces)
    simulator.each(jacobian.multiply, pieces[::-1])
    return jacobian.result()


class _Jacobian:
    """J with its rows in the order of the steps on which unknowns begin to act, filled piece by piece.

    It is kept in single precision: the differences are good to three digits.

    Attributes:
        first: (n,) those steps.
    """

    def __init__(self, task: Task, simulator: Simulator, x: Array, scale: Array) -> None:
        """Roll out the point itself."""
        self._task, self._simulator, self._x, self._scale = task, simulator, x, scale
        state, ctrl = task.states(x[None])[0], task.control(x[None])[0]
        self._nominal = simulator.run(state, ctrl[None], task.at_steps)
        self._states = simulate(task.problem.model, state, ctrl[:-1])  # (N + 1, nstate)
        here = task.residuals(self._nominal)
        self._roots = [term.roots() for term in here]
        self._residual: Array = gauss_newton.residuals(here, self._roots)[0]  # (F, K)
        began = task.started(np.arange(len(x)))  # (n,)
        self._order = np.argsort(began, kind="stable")
        self.first: IntArray = began[self._order]
        self._evaluations = 2.0 + float(np.sum(1.0 - began / (len(ctrl) - 1)))
        n = len(x)
        self._rows = np.zeros((n, self._residual.size), np.float32)
        self._gradient, self._curvature = np.zeros(n), np.zeros((n, n))

    def measure(self, piece: slice) -> None:
        """Rows of a piece, from rollouts of unknowns that begin to act on the same step, and their J r."""
        task, rows, start = self._task, self._order[piece], self.first[piece.start]
        moved = np.repeat(self._x[None], len(rows), axis=0)
        moved[np.arange(len(rows)), rows] += DIFFERENCE * self._scale[rows]
        frame = self._acted(piece)
        since = max(frame - DIFFERENCES, 0)
        states = self._states[start] if start else task.states(moved)
        rolled = self._simulator.run(states, task.control(moved)[:, start:], task.at_steps[frame:] - start)
        terms = task.residuals(_joined(self._nominal, rolled, since, frame), since)
        after = gauss_newton.residuals(terms, self._roots)[:, frame - since :]  # (P, F - frame, K)
        before = self._residual[frame:]
        slope = (after - before).reshape(len(rows), -1) / DIFFERENCE
        valid = rolled.finite & (np.abs(slope).max(axis=1, initial=0.0) < JACOBIAN_MAX)
        slope[~valid] = 0.0
        self._rows[piece, self._column(piece) :] = slope
        self._gradient[piece] = slope @ before.ravel()

    def multiply(self, piece: slice) -> None:
        """Rows of J Jᵀ of a piece, up to the diagonal."""
        column = self._column(piece)
        known = self._rows[: piece.stop, column:]
        self._curvature[piece, : piece.stop] = self._rows[piece, column:] @ known.T

    def result(self) -> Linearised:
        """What was measured, in the order of the unknowns."""
        whole = np.tril(self._curvature) + np.tril(self._curvature, -1).T
        back = np.argsort(self._order)
        return Linearised(whole[np.ix_(back, back)], self._gradient[back], self._evaluations)

    def _acted(self, piece: slice) -> int:
        """First frame of the loss on which the unknowns of a piece have acted."""
        start = self.first[piece.start]
        return int(np.searchsorted(self._task.at_steps, start, side="right")) if start else 0

    def _column(self, piece: slice) -> int:
        """First column of J on which the unknowns of a piece act."""
        return self._acted(piece) * int(self._residual.shape[1])


def _pieces(first: IntArray, most: int) -> list[slice]:
    """Rows in the order of their first steps (n,), cut so that all of a piece have the same one."""
    bounds = [0, *(np.flatnonzero(np.diff(first)) + 1).tolist(), len(first)]
    pieces = []
    for begin, end in itertools.pairwise(bounds):
        cuts = [*range(begin, end, most), end]
        pieces += [slice(*cut) for cut in itertools.pairwise(cuts)]
    return pieces


def _joined(nominal: Rollouts, rolled: Rollouts, since: int, frame: int) -> Rollouts:
    """Rollouts at the frames from `since` on: those before `frame`, where they begin, as the nominal one."""

    def join(before: Array, after: Array) -> Array:
        known = np.broadcast_to(before[:, since:frame], (len(after), frame - since, *before.shape[2:]))
        return np.concatenate((known, after), axis=1)

    return Rollouts(
        join(nominal.qpos, rolled.qpos),
        join(nominal.points_m, rolled.points_m),
        join(nominal.com_m, rolled.com_m),
        rolled.finite,
    )
