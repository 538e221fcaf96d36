"""Phases of contact and flight, in turn, from labels by frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from simrecon.types import Array, Flags


@dataclass(frozen=True)
class Phase:
    """One phase of one point.

    Attributes:
        contact: whether the point rests; else it flies.
        start_s, end_s: since the first frame.
    """

    contact: bool
    start_s: float
    end_s: float

    @property
    def length_s(self) -> float:
        """Its duration."""
        return self.end_s - self.start_s

    def frames(self, times_s: Array) -> Flags:
        """Which of some times are in it, (T,)."""
        return np.asarray((times_s >= self.start_s - 1e-9) & (times_s <= self.end_s + 1e-9))


def phases(contact: Flags, times_s: Array, shortest_s: float) -> tuple[Phase, ...]:
    """Phases of a point; they change half-way between two frames.

    Args:
        contact: (T,) its labels.
        times_s: (T,) since the first frame.
        shortest_s: what is shorter belongs to what is around it, the shortest first.
    """
    changes = np.flatnonzero(np.diff(contact.astype(int))) + 1
    ends = [0.0, *((times_s[changes - 1] + times_s[changes]) / 2).tolist(), float(times_s[-1])]
    rows = [0, *changes.tolist()]
    found = [Phase(bool(contact[row]), *span) for row, span in zip(rows, pairwise(ends), strict=True)]
    while len(found) > 1:
        row = min(range(len(found)), key=lambda i: found[i].length_s)
        if found[row].length_s >= shortest_s:
            break
        found[row] = replace(found[row], contact=not found[row].contact)
        found = _joined(found)
    return tuple(found)


def moved(old: tuple[Phase, ...], ends_s: Array) -> tuple[Phase, ...]:
    """The same phases with other inner ends (n - 1,)."""
    edges = [old[0].start_s, *ends_s.tolist(), old[-1].end_s]
    return tuple(
        replace(phase, start_s=start, end_s=end)
        for phase, start, end in zip(old, edges[:-1], edges[1:], strict=True)
    )


def _joined(found: list[Phase]) -> list[Phase]:
    """Neighbours of one kind as one phase."""
    kept: list[Phase] = []
    for phase in found:
        if kept and kept[-1].contact == phase.contact:
            kept[-1] = replace(kept[-1], end_s=phase.end_s)
        else:
            kept.append(phase)
    return kept
