"""One wrapper of nlopt's L-BFGS (Luksan's LD_LBFGS; D. Liu and J. Nocedal 1989) with one status."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

import nlopt
import numpy as np

from simrecon.types import Array

MEMORY = 10
"""Pairs of steps and gradient changes that approximate the Hessian."""

Objective = Callable[[Array], tuple[float, Array]]


class Status(Enum):
    """How a minimisation ended."""

    CONVERGED = "the loss changed by less than ftol_rel, x no longer changed, or the gradient vanished"
    STALLED = "the line search found no lower loss: rounding, or a gradient that does not fit the loss"
    EVALUATIONS = "all evaluations used"
    FAILED = "the loss or its gradient was not finite at the start"


@dataclass(frozen=True, eq=False)
class Minimum:
    """The best point that was evaluated.

    Attributes:
        x: (n,) always finite; the start if no loss was finite.
        loss: at x; inf if no loss was finite.
        evaluations: calls of the objective.
        status: how it ended.
        trace: (evaluations,) best loss so far.
    """

    x: Array
    loss: float
    evaluations: int
    status: Status
    trace: Array


def minimize(
    fun: Objective,
    x0: Array,
    *,
    max_evaluations: int,
    ftol_rel: float,
    lower: Array | None = None,
    memory: int = MEMORY,
) -> Minimum:
    """Minimise a smooth function from its value and gradient, above bounds if there are any.

    A point where the loss or the gradient is not finite counts as far worse than the best, so that the line
    search backs off. An exception of `fun` ends the search and is raised again as it was. The unit of the
    loss does not matter. Bounds become active one at a time, one for each line search: expect slow progress
    where hundreds of them are.

    Args:
        fun: x (n,) -> loss, gradient (n,). It gets a copy of its own.
        x0: (n,) start, not below the bounds.
        max_evaluations: limit on the calls of `fun`.
        ftol_rel: relative change of the loss between two iterations at which the search is done.
        lower: (n,) bounds, -inf = none; or None.
        memory: pairs of steps and gradient changes that are kept.

    Raises:
        ValueError: a shape or a value that can't be used, or a gradient of the wrong shape.
    """
    x0 = np.array(x0, dtype=np.float64)
    if x0.ndim != 1 or x0.size == 0 or not np.isfinite(x0).all():
        raise ValueError(f"x0: shape {x0.shape}; valid is a finite (n,) array with n >= 1")
    if max_evaluations < 1 or not 0 <= ftol_rel < math.inf:
        raise ValueError(f"max_evaluations {max_evaluations}, ftol_rel {ftol_rel}; valid are >= 1 and >= 0")
    low = np.full(x0.size, -math.inf) if lower is None else np.array(lower, dtype=np.float64)
    if low.shape != x0.shape or np.isnan(low).any():
        raise ValueError(f"lower: shape {low.shape}; valid is {x0.shape} without NaN")
    if not (low <= x0).all():
        raise ValueError("x0: below the bounds; valid is lower <= x0")

    optimiser = nlopt.opt(nlopt.LD_LBFGS, x0.size)
    optimiser.set_lower_bounds(low)
    optimiser.set_vector_storage(memory)
    optimiser.set_maxeval(max_evaluations)
    optimiser.set_ftol_rel(ftol_rel)
    # The default (which 0 stands for) stops where the gradient is below 1e-8, whatever the unit of the loss.
    optimiser.set_param("tolg", 1e-300)
    search = _Search(fun, x0, max_evaluations, optimiser.force_stop)
    optimiser.set_min_objective(search)
    code = _run(optimiser, x0)
    # nlopt and the search hold each other, which no collector sees: let go of what the loss holds
    search.fun = _spent
    if search.error is not None:
        raise search.error
    return Minimum(search.x, search.loss, search.evaluations, search.status(code), np.array(search.trace))


@dataclass(eq=False)
class _Search:
    """The objective as nlopt calls it, and what it has seen.

    The library's first step is the negative gradient, and it gives up if that is many orders too long. So it
    sees a scaled loss whose gradient has unit length at the start.
    """

    fun: Objective
    x: Array
    max_evaluations: int
    stop: Callable[[], None]
    loss: float = math.inf
    scale: float = 1.0
    trace: list[float] = field(default_factory=list)
    error: BaseException | None = None

    @property
    def evaluations(self) -> int:
        return len(self.trace)

    def __call__(self, point: Array, gradient: Array) -> float:
        # nlopt finishes a line search before it heeds its limit or a stop.
        if self.error is not None or self.evaluations >= self.max_evaluations:
            self.stop()
            return self._far_worse()
        # nlopt would turn an exception into one without type and message, so none may leave this function.
        try:
            return self._evaluate(np.array(point), gradient)
        except BaseException as error:
            self.error = error
            self.stop()
            return self._far_worse()

    def _evaluate(self, point: Array, gradient: Array) -> float:
        value, slope = self.fun(point.copy())
        loss, slope = float(value), np.asarray(slope, dtype=np.float64)
        if slope.shape != point.shape:
            raise ValueError(f"gradient: shape {slope.shape}; valid is {point.shape}")
        finite = math.isfinite(loss) and bool(np.isfinite(slope).all())
        if finite and loss < self.loss:
            self.x, self.loss = point, loss
        self.trace.append(self.loss)
        if self.loss == math.inf:
            self.stop()
        if not finite:
            gradient[:] = 0.0
            return self._far_worse()
        if len(self.trace) == 1:
            self.scale = 1.0 / (float(np.linalg.norm(slope)) or 1.0)
        gradient[:] = self.scale * slope
        return self.scale * loss

    def _far_worse(self) -> float:
        """A finite loss that no line search accepts."""
        best = self.scale * self.loss if math.isfinite(self.loss) else 0.0
        return best + 10.0 * (1.0 + abs(best))

    def status(self, code: int) -> Status:
        if self.loss == math.inf:
            return Status.FAILED
        if code > 0 and code != nlopt.MAXEVAL_REACHED:
            return Status.CONVERGED
        return Status.EVALUATIONS if self.evaluations >= self.max_evaluations else Status.STALLED


def _spent(_x: Array) -> tuple[float, Array]:
    """Stands for a loss that is not needed any more."""
    raise RuntimeError("the search is over")


def _run(optimiser: nlopt.opt, x0: Array) -> int:
    """Result code of nlopt; failures are data, not exceptions."""
    with contextlib.suppress(nlopt.RoundoffLimited, nlopt.ForcedStop, nlopt.runtime_error, RuntimeError):
        optimiser.optimize(x0)
    return int(optimiser.last_optimize_result())
