"""When which part of the body touches the scene: as it is taken to be, and as a user wishes it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from simrecon.types.arrays import Array, Flags, IntArray

Interval = tuple[float, float]
"""From and to, s, both included."""


@dataclass(frozen=True, eq=False)
class ContactLabels:
    """When which part of the body rests on something.

    Attributes:
        parts: P names (`contact.parts`).
        probability: (T, P) that a part rests on the scene, 0 to 1; NaN where the source says nothing of it.
        source: `rules`, `network`, `file`, or what else they are made of.
    """

    parts: tuple[str, ...]
    probability: Array
    source: str

    def of(self, part: str) -> Array:
        """Probability of a part, (T,)."""
        column: Array = self.probability[:, self.parts.index(part)]
        return column

    def at(self, frames: slice | IntArray) -> Self:
        """Those of some frames."""
        return replace(self, probability=self.probability[frames])

    def known(self, part: str) -> bool:
        """Whether anything is said of a part."""
        return part in self.parts and bool(np.isfinite(self.of(part)).any())


@dataclass(frozen=True)
class ContactWish:
    """What a user wishes of one part (`contacts.toml`).

    Attributes:
        part: its name.
        mode: `auto`: as it is found; `always`: it touches and stays where it is, in all frames; `never`: it
            touches in none; `grounded`: it is on what bears it in all frames, and may slide along it.
        touch, free, auto: intervals in which it touches and stays, does not touch, or is as found; they come
            before the mode.
    """

    part: str
    mode: str = "auto"
    touch: tuple[Interval, ...] = ()
    free: tuple[Interval, ...] = ()
    auto: tuple[Interval, ...] = ()


@dataclass(frozen=True, eq=False)
class ContactTargets:
    """Wishes by frame; P parts in the order of `contact.parts`.

    Attributes:
        parts: P names.
        touch: (T, P) the part touches; stay: (T, P) and stays where it is; free: (T, P) it does not touch.
    """

    parts: tuple[str, ...]
    touch: Flags
    stay: Flags
    free: Flags

    def at(self, frames: slice | IntArray) -> Self:
        """Those of some frames."""
        return replace(self, touch=self.touch[frames], stay=self.stay[frames], free=self.free[frames])
