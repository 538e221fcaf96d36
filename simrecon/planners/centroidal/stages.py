"""Three stages: curves near the input, then the laws of motion, then durations (Rempe 2020, 3.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from simrecon.planners.centroidal import dynamic, geometric, program
from simrecon.planners.centroidal.inputs import Inputs
from simrecon.planners.centroidal.laws import Law
from simrecon.planners.centroidal.model import Model, Phasing, model, objective
from simrecon.planners.centroidal.phases import moved
from simrecon.planners.centroidal.program import End, Program
from simrecon.planners.centroidal.settings import Settings, Solver
from simrecon.types import Array

SHORT = 0.9
"""Share of the least length of a phase that a search which did not come to its end may leave."""
BROKEN = 1e-3
"""A constraint is broken that is off by more than that in its own unit."""


@dataclass(frozen=True)
class Asked:
    """What a stage is asked for: the laws of motion, and whether all constraints must hold."""

    forces: bool = True
    strict: bool = True


@dataclass(frozen=True, eq=False)
class Solved:
    """A stage at its end.

    Attributes:
        model: that was solved; laws: that were asked of it.
        end: of the search.
    """

    model: Model
    laws: tuple[Law, ...]
    end: End

    @property
    def broken(self) -> str:
        """The constraint that is broken most, and when, in words; empty if none is."""
        worst, said, at = BROKEN, "", 0
        for entry in self.laws:
            own = self.end.values[at : at + len(entry.low)]
            off = np.maximum(np.maximum(entry.low - own, own - entry.high), 0.0)
            at += len(entry.low)
            if off.max() > worst:
                worst, times = float(off.max()), entry.times_s[off > max(BROKEN, off.max() / 2)]
                said = f"{entry.name} at {times.min():.2f} to {times.max():.2f} s"
        return said


def solve(inputs: Inputs, settings: Settings) -> Solved:
    """The better of the plan with the input's durations and that with its own (C.3).

    Where there is none, constraints give way at a price.
    """
    phasing = tuple(target.touching.phases for target in inputs.targets)
    near = _fixed(inputs, settings, phasing, None, Asked(forces=False))
    asked = Asked()
    best = _fixed(inputs, settings, phasing, near.end.x, asked)
    if not best.end.converged:
        asked = Asked(strict=False)
        best = _fixed(inputs, settings, phasing, near.end.x, asked)
    for _ in range(settings.durations.rounds):
        changed = _retimed(best, asked)
        if changed is None:
            break
        again = _fixed(inputs, settings, *changed, asked)
        if not _better(again.end, best.end):
            break
        best = again
    return best


def _better(a: End, b: End) -> bool:
    return (a.converged, -a.cost) > (b.converged, -b.cost)


def _fixed(inputs: Inputs, settings: Settings, phasing: Phasing, start: Array | None, asked: Asked) -> Solved:
    """With ends of phases that stay."""
    made = model(inputs, settings, phasing, free=False)
    entries = geometric.of_motion(made) + (dynamic.of_forces(made) if asked.forces else [])
    x = np.concatenate(made.unknowns.starts)[: made.unknowns.count if asked.forces else made.of_motion]
    if start is not None:
        x[: len(start)] = start
    return _searched(made, entries, x, np.full(len(x), np.inf), asked)


def _retimed(before: Solved, asked: Asked) -> tuple[Phasing, Array] | None:
    """Other ends of the phases, and the unknowns but for them; None if none may move or a phase would vanish.

    The search need not come to its end: the next one is fixed, and tells whether these ends are better.
    """
    settings, x = before.model.settings, before.end.x
    phasing = tuple(limb.phases for limb in before.model.limbs)
    made = model(before.model.inputs, settings, phasing, free=True)
    ends = np.concatenate(made.unknowns.starts)[len(x) :]
    if not len(ends):
        return None
    entries = [*geometric.of_motion(made), *dynamic.of_forces(made), *geometric.ordered(made)]
    near = np.concatenate((np.full(len(x), np.inf), np.full(len(ends), settings.durations.step_s)))
    few = replace(settings.solver, iterations=settings.durations.iterations)
    found = _searched(made, entries, np.concatenate((x, ends)), near, asked, few).end
    cuts = np.cumsum([len(own) - 1 for own in phasing])[:-1]
    shifted = np.split(found.x[len(x) :], cuts)
    changed = tuple(moved(own, at) for own, at in zip(phasing, shifted, strict=True))
    shortest = min(phase.length_s for own in changed for phase in own)
    if not np.isfinite(found.x).all() or shortest < SHORT * settings.durations.shortest_s:
        return None
    return changed, found.x[: len(x)]


def _searched(
    made: Model, entries: list[Law], start: Array, near: Array, asked: Asked, solver: Solver | None = None
) -> Solved:
    """The search for the unknowns of a stage."""
    values = ca.vertcat(*(entry.values for entry in entries))
    low, high = (np.concatenate([getattr(entry, side) for entry in entries]) for side in ("low", "high"))
    x = made.x[: len(start)]
    cost = objective(made, forces=asked.forces) + made.settings.weights.ridge * ca.sumsqr(x - ca.DM(start))
    prices = np.concatenate(
        [np.full(len(entry.low), np.inf if asked.strict else entry.price) for entry in entries]
    )
    whole = Program(x, cost, values, made.samples, low, high, near, prices)
    return Solved(made, tuple(entries), program.minimise(whole, start, solver or made.settings.solver))
