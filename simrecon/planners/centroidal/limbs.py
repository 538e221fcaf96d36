"""Places and forces of a point that is in contact and in flight in turn (Rempe 2020, C.1)."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from simrecon.planners.centroidal.curves import AXES, Curve, Nodes, Sampled, Symbols, Unknowns
from simrecon.planners.centroidal.inputs import Target
from simrecon.planners.centroidal.phases import Phase
from simrecon.planners.centroidal.settings import Polynomials
from simrecon.types import Array, IntArray

ZERO = np.zeros((1, AXES))


@dataclass(eq=False)
class Limb:
    """Curves of one point.

    Attributes:
        target: the point, and its input.
        phases: its phases, with their ends as numbers.
        place: m; force: in body weights.
        place_phase, force_phase: phase of each piece of them.
    """

    target: Target
    phases: tuple[Phase, ...]
    place: Curve
    force: Curve
    place_phase: IntArray
    force_phase: IntArray

    def contact(self, times_s: Array) -> IntArray:
        """The phase of each time (N,) in which the point is in contact; -1 in flight."""
        rows = self.force_phase[self.force.piece(times_s)]
        return np.where([self.phases[row].contact for row in rows], rows, -1)


@dataclass(frozen=True, eq=False)
class Timing:
    """Ends of phases (n + 1,): symbols or numbers, and numbers."""

    symbols: Symbols
    numbers: Array

    def cut(self, counts: list[int]) -> tuple[Symbols, Array, IntArray]:
        """Ends of pieces, in both forms, if each phase is cut into so many, and the phase of each."""
        share = np.concatenate([i + np.arange(n) / n for i, n in enumerate(counts)] + [[float(len(counts))]])
        phase = np.minimum(share.astype(int), len(counts) - 1)
        rest = share - phase
        before, after = phase.tolist(), (phase + 1).tolist()
        symbols = ca.DM(1 - rest) * self.symbols[before, :] + ca.DM(rest) * self.symbols[after, :]
        numbers = (1 - rest) * self.numbers[phase] + rest * self.numbers[phase + 1]
        return symbols, numbers, phase[:-1]


def pieces(phase: Phase, settings: Polynomials) -> int:
    """Cubics of a phase, by its length in the input: ends that move leave their number as it is."""
    return max(settings.per_phase, int(np.ceil(phase.length_s / settings.piece_s - 1e-6)))


def place(
    unknowns: Unknowns, target: Target, phases: tuple[Phase, ...], timing: Timing, sampled: Sampled,
    settings: Polynomials,
) -> tuple[Curve, IntArray]:  # fmt: skip
    """The places: one unknown a contact, free curves between them."""
    name, nodes = target.point.name, Nodes()
    rest = [
        nodes.add(unknowns.new(name, sampled.mean(phase.start_s, phase.end_s)), ca.SX(ZERO))
        if phase.contact
        else None
        for phase in phases
    ]
    counts = [1 if phase.contact else pieces(phase, settings) for phase in target.touching.phases]
    ends, numbers, owner = timing.cut(counts)
    for i, (own, count) in enumerate(zip(rest, counts, strict=True)):
        if own is not None:
            nodes.chain([own, own])
            continue
        at = numbers[np.flatnonzero(owner == i)[0] :][: count + 1]
        values, rates = sampled.at(at), sampled.rate(at)
        chain = [
            rest[i - 1] if i > 0 else None,
            *[None] * (count - 1),
            rest[i + 1] if i + 1 < len(rest) else None,
        ]
        nodes.chain(
            [
                nodes.add(unknowns.new(name, values[k]), unknowns.new(name, rates[k]))
                if node is None
                else node
                for k, node in enumerate(chain)
            ]
        )
    return nodes.curve(ends, numbers), owner


def force(
    unknowns: Unknowns, target: Target, phases: tuple[Phase, ...], timing: Timing, sampled: Sampled,
    settings: Polynomials,
) -> tuple[Curve, IntArray]:  # fmt: skip
    """The forces: zero in flight, and where it begins and ends."""
    name, nodes = f"{target.point.name}_force", Nodes()
    counts = [pieces(phase, settings) if phase.contact else 1 for phase in target.touching.phases]
    ends, numbers, owner = timing.cut(counts)
    for i, (phase, count) in enumerate(zip(phases, counts, strict=True)):
        if not phase.contact:
            nodes.chain([nodes.add(ca.SX(ZERO), ca.SX(ZERO)) for _ in range(2)])
            continue
        at = numbers[np.flatnonzero(owner == i)[0] :][: count + 1]
        values = sampled.at(at)
        chain = []
        for k in range(count + 1):
            edge = (k == 0 and i > 0) or (k == count and i + 1 < len(phases))
            value = ca.SX(ZERO) if edge else unknowns.new(name, values[k])
            chain.append(nodes.add(value, unknowns.new(name, ZERO)))
        nodes.chain(chain)
    return nodes.curve(ends, numbers), owner
