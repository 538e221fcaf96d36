"""A solved plan at the frames of its clip, in plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from simrecon.metrics.dynamics import GRAVITY_MPS2
from simrecon.planners.centroidal import euler
from simrecon.planners.centroidal.curves import Symbols
from simrecon.planners.centroidal.points import Point
from simrecon.planners.centroidal.stages import Solved
from simrecon.types import Array, Flags


@dataclass(frozen=True, eq=False)
class Planned:
    """A plan; T frames, P points.

    Attributes:
        times_s: (T,) since the first frame.
        com_m: (T, 3); axes: (T, 3, 3) of the root; input_com_m: (T, 3) before the plan.
        points: P; places_m: (P, T, 3); force_N: (P, T, 3); contact: (P, T).
        converged: whether all conditions of a minimum hold.
        notes: in words: what gave way.
    """

    times_s: Array
    com_m: Array
    axes: Array
    input_com_m: Array
    points: tuple[Point, ...]
    places_m: Array
    force_N: Array
    contact: Flags
    converged: bool
    notes: tuple[str, ...]


def at_frames(solved: Solved) -> Planned:
    """What was solved, at the frames."""
    model, times = solved.model, solved.model.inputs.times_s
    weight_N = model.inputs.mass_kg * GRAVITY_MPS2
    curves: list[Symbols] = [model.com.at(times), model.turn.at(times)]
    for limb in model.limbs:
        curves += [limb.place.at(times), limb.force.at(times)]
    unknowns = model.x[: len(solved.end.x)]
    values = [np.array(value) for value in ca.Function("frames", [unknowns], curves)(solved.end.x)]
    return Planned(
        times,
        values[0],
        euler.matrix(values[1], model.inputs.axes),
        model.inputs.com_m,
        tuple(limb.target.point for limb in model.limbs),
        np.stack(values[2::2]),
        weight_N * np.stack(values[3::2]),
        np.stack([limb.contact(times) >= 0 for limb in model.limbs]),
        solved.end.converged,
        (*model.inputs.notes, *said(solved)),
    )


def said(solved: Solved) -> tuple[str, ...]:
    """What did not hold, in words."""
    lines = []
    if solved.broken:
        lines.append(f"no plan keeps all constraints; the best one breaks {solved.broken}")
    if not solved.end.converged:
        lines.append(f"the search did not converge ({solved.end.status.replace('_', ' ').lower()})")
    return tuple(lines)
