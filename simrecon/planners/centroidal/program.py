"""Nonlinear programs for IPOPT, with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from simrecon.planners.centroidal.curves import Samples, Symbols
from simrecon.planners.centroidal.derivatives import Written, problem
from simrecon.planners.centroidal.settings import Solver
from simrecon.types import Array

CONVERGED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")
VIOLATION = 1e-5
"""Of a constraint in its own unit, at the end."""
BEGIN = 0.1
"""Excess at which a search begins."""
PIVOT = 1e-8
"""Least pivot of the linear systems, relative. With IPOPT's 1e-6 those of many points in contact fill up:
six times the time for the same steps. IPOPT raises it where steps are not exact enough; 0 goes astray."""


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise f(x) + Σ price · excess with low ≤ g(x) ≤ high, but for the excess of what has a price.

    Attributes:
        x, cost, values: symbols of the unknowns, of f and of g.
        samples: by which cost and values are written beside the unknowns.
        low, high: bounds of g, numbers.
        near: (n,) most that each unknown may move.
        prices: of g, infinite where it must hold.
    """

    x: Symbols
    cost: Symbols
    values: Symbols
    samples: Samples
    low: Array
    high: Array
    near: Array
    prices: Array


@dataclass(frozen=True, eq=False)
class End:
    """Where a search ended.

    Attributes:
        x: the unknowns; values: g there; cost: f there.
        status: in IPOPT's words; iterations: of it.
    """

    x: Array
    values: Array
    cost: float
    status: str
    iterations: int

    @property
    def converged(self) -> bool:
        """Whether all conditions of a minimum hold."""
        return self.status in CONVERGED


def minimise(program: Program, start: Array, settings: Solver) -> End:
    """Search from `start` (n,)."""
    soft = np.flatnonzero(np.isfinite(program.prices))
    excess = ca.SX.sym("excess", len(soft), 2)
    x, cost, values = ca.vertcat(program.x, ca.vec(excess)), program.cost, ca.SX(program.values)
    cost += ca.dot(ca.DM(program.prices[soft]), ca.sum2(excess)) if len(soft) else 0.0
    values[soft.tolist()] += excess[:, 1] - excess[:, 0]
    options: dict[str, Any] = {
        "print_time": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.max_iter": settings.iterations,
        "ipopt.tol": settings.tolerance,
        "ipopt.constr_viol_tol": VIOLATION,
        "ipopt.mumps_pivtol": PIVOT,
    }
    inner = (ca.vertcat(*rows) for rows in (program.samples.symbols, program.samples.values))
    written, derivatives = problem(Written(x, cost, values, *inner))
    solver = ca.nlpsol("plan", "ipopt", written, options | derivatives)
    more, count = np.full(2 * len(soft), BEGIN), len(start)
    end = solver(
        x0=np.concatenate((start, more)),
        lbg=program.low,
        ubg=program.high,
        lbx=np.concatenate((start - program.near, np.zeros(len(more)))),
        ubx=np.concatenate((start + program.near, np.full(len(more), np.inf))),
    )
    found, reached = np.array(end["x"]).ravel(), np.array(end["g"]).ravel()
    over, under = found[count:].reshape(2, -1)
    reached[soft] += over - under
    stats = solver.stats()
    return End(found[:count], reached, float(end["f"]), stats["return_status"], int(stats["iter_count"]))
