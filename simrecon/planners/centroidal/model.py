"""The reduced body as unknown curves: centre of mass, turn, points, forces (Rempe 2020, 3.1)."""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from simrecon.planners.centroidal import limbs as limb_curves
from simrecon.planners.centroidal.curves import Curve, Sampled, Samples, Symbols, Unknowns, even
from simrecon.planners.centroidal.inputs import Inputs, Target
from simrecon.planners.centroidal.limbs import Limb, Timing
from simrecon.planners.centroidal.phases import Phase
from simrecon.planners.centroidal.settings import Settings
from simrecon.types import Array

Phasing = tuple[tuple[Phase, ...], ...]
"""Phases of each point."""


@dataclass(eq=False)
class Model:
    """Curves of a clip.

    Attributes:
        inputs, settings: what they are to be like.
        com, turn: place of the centre of mass, m, and Euler angles, rad.
        limbs: points and forces.
        ends: inner ends of each point's phases, symbols or numbers.
        unknowns: all of them: of the motion first, then of the forces, then the ends if they are free.
        of_motion: how many are of the motion.
        free: whether the ends are unknowns.
        samples: of the curves, by which laws and objective are written.
    """

    inputs: Inputs
    settings: Settings
    com: Curve
    turn: Curve
    limbs: tuple[Limb, ...]
    ends: tuple[Symbols, ...]
    unknowns: Unknowns
    of_motion: int
    free: bool
    samples: Samples = field(default_factory=Samples)

    @property
    def x(self) -> Symbols:
        """All unknowns as one column."""
        return ca.vertcat(*self.unknowns.symbols)


def model(inputs: Inputs, settings: Settings, phasing: Phasing, *, free: bool) -> Model:
    """Curves for phases that are fixed, or whose ends are free."""
    unknowns, duration = Unknowns(), float(inputs.times_s[-1])
    spacing = settings.polynomials.com_s
    com = even(unknowns, "com", duration, spacing, Sampled(inputs.times_s, inputs.com_m))
    turn = even(unknowns, "turn", duration, spacing, Sampled(inputs.times_s, inputs.turn_rad))
    inner = [np.array([phase.end_s for phase in own[:-1]]) for own in phasing]
    symbols = [ca.SX.sym(f"end_{i}", len(ends)) if free else ca.DM(ends) for i, ends in enumerate(inner)]
    timings = [_timing(own, ends) for own, ends in zip(phasing, symbols, strict=True)]
    places = [
        limb_curves.place(
            unknowns, target, own, timing, Sampled(inputs.times_s, target.place_m), settings.polynomials
        )
        for target, own, timing in zip(inputs.targets, phasing, timings, strict=True)
    ]
    of_motion = unknowns.count
    loads = _loads(inputs, phasing)
    forces = [
        limb_curves.force(unknowns, target, own, timing, load, settings.polynomials)
        for target, own, timing, load in zip(inputs.targets, phasing, timings, loads, strict=True)
    ]
    limbs = tuple(
        Limb(target, own, place[0], force[0], place[1], force[1])
        for target, own, place, force in zip(inputs.targets, phasing, places, forces, strict=True)
    )
    if free:
        for ends, start in zip(symbols, inner, strict=True):
            unknowns.symbols.append(ends)
            unknowns.starts.append(start)
    return Model(inputs, settings, com, turn, limbs, tuple(symbols), unknowns, of_motion, free)


def _timing(phases: tuple[Phase, ...], ends: Symbols) -> Timing:
    numbers = np.array([phases[0].start_s, *(phase.end_s for phase in phases)])
    return Timing(ca.vertcat(numbers[0], ends, numbers[-1]), numbers)


def _loads(inputs: Inputs, phasing: Phasing) -> list[Sampled]:
    """Body weight, upwards, shared by the points in contact, of each point: where the search begins."""
    times = inputs.times_s
    touching = np.array([np.any([p.contact & p.frames(times) for p in own], axis=0) for own in phasing])
    share = touching / np.maximum(touching.sum(axis=0), 1)  # (P, T)
    return [Sampled(times, np.outer(own, [0.0, 0.0, 1.0])) for own in share]


def objective(model: Model, *, forces: bool) -> Symbols:
    """E_data + E_vel + E_acc + E_dur (eqs. 1 to 4), and, ours, small forces that bend little."""
    inputs, weights = model.inputs, model.settings.weights
    times, unit = inputs.times_s, weights.unit_s
    com = (weights.com, weights.com_velocity * unit**2, weights.com_acceleration * unit**4)
    turn = (weights.turn, weights.turn_velocity * unit**2, weights.turn_acceleration * unit**4)
    point = (weights.point, weights.point_velocity * unit**2, weights.point_acceleration * unit**4)
    total = _followed(model, model.com, inputs.com_m, times, com) + _followed(
        model, model.turn, inputs.turn_rad, times, turn
    )
    for limb in model.limbs:
        total += _followed(model, limb.place, limb.target.place_m, times, point)
        if forces:
            total += weights.force * ca.sumsqr(model.samples.of(limb.force, times))
            total += weights.force_bend * ca.sumsqr(model.samples.of(limb.force, times, 2))
    return total + weights.duration * sum(_moved(model, i) for i in range(len(model.limbs)))


def _followed(
    model: Model, curve: Curve, input_: Array, times: Array, weights: tuple[float, float, float]
) -> Symbols:
    """Squared distance from the input, velocity and acceleration, weighted, summed over frames."""
    off = [model.samples.of(curve, times, order) for order in range(3)]
    off[0] -= ca.DM(input_)
    return sum(weight * ca.sumsqr(value) for weight, value in zip(weights, off, strict=True))


def _moved(model: Model, row: int) -> Symbols:
    """Squared change of the durations of a point's phases against the input's."""
    before = model.inputs.targets[row].touching.phases
    ends = ca.vertcat(0.0, model.ends[row], before[-1].end_s)
    return ca.sumsqr(ends[1:] - ends[:-1] - ca.DM([phase.length_s for phase in before]))


__all__ = ["Model", "Phasing", "Target", "model", "objective"]
