"""Which wishes of contact hold, in a kinematic fit and in a simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.contact import rules
from simrecon.types import Array, ContactTargets, Flags

CANNOT_M = 0.3
"""A part that is to touch and is farther than that in the fit is elsewhere by the evidence."""


@dataclass(frozen=True, eq=False)
class Honoured:
    """One wish of one part.

    Attributes:
        part: its name; kind: `touch`, `stay` or `free`.
        asked: (T,) frames for which it is asked.
        held: (T,) frames in which it is so, asked or not.
    """

    part: str
    kind: str
    asked: Flags
    held: Flags

    @property
    def share(self) -> float:
        """Share of the frames asked for in which it holds."""
        return float(self.held[self.asked].mean())


def honoured(asked: ContactTargets, touches: Flags, speed_mps: Array) -> tuple[Honoured, ...]:
    """Each kind of wish of each part.

    Args:
        asked: wishes.
        touches: (T, P) which parts touch.
        speed_mps: (T, P) of the parts, by the frame they arrive at; what comes to rest in a frame is still in
            it, if it then stays.
    """
    still = touches & (_staying(asked.stay, speed_mps) < rules.SLOW_MPS)
    kinds = (
        ("stay", asked.stay, still),
        ("touch", asked.touch & ~asked.stay, touches),
        ("free", asked.free, ~touches),
    )
    return tuple(
        Honoured(part, kind, frames[:, column], held[:, column])
        for column, part in enumerate(asked.parts)
        for kind, frames, held in kinds
        if frames[:, column].any()
    )


def _staying(stay: Flags, speed_mps: Array) -> Array:
    """Speeds (T, P) by the steps within what is to stay: its first frame has that of the step from it."""
    begins = stay.copy()
    begins[1:] &= ~stay[:-1]
    goes_on = np.zeros_like(stay)
    goes_on[:-1] = stay[1:]
    after = np.concatenate((speed_mps[1:], speed_mps[-1:]))
    return np.where(begins & goes_on, after, speed_mps)


def impossible(asked: ContactTargets, clearance_m: Array) -> Flags:
    """Frames (T, P) in which a part is to touch that is elsewhere, by its distance from everything (T, P)."""
    return np.asarray(asked.touch & (clearance_m > CANNOT_M))


def possible(asked: ContactTargets, clearance_m: Array) -> ContactTargets:
    """The wishes without those that are `impossible`."""
    kept = ~impossible(asked, clearance_m)
    return replace(asked, touch=asked.touch & kept, stay=asked.stay & kept)
