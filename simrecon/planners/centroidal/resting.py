"""When a point rests: intervals in which its labels say so and it stays where it is, found all at once.

Of all ways to cut the clip into contact and flight in turn, that which has the least

    Σ_contacts Σ_t (‖x_t - x̄‖² / σ² - e_t) + c · cuts

with evidence e_t = logit p_t - logit p₀ of contact over a threshold p₀, and x̄ the mean place over that
contact, by dynamic programming over where the intervals end. A plan holds a point of a contact in one place,
so that a label which lasts through a step would put the foot between the two places where it stood.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.types import Array, Flags

SURE = 3.0
"""Most evidence of a frame, either way."""


@dataclass(frozen=True)
class Costs:
    """What an interval costs, in evidence of a frame.

    Attributes:
        spread_m: σ; cut: c; fewest: frames of an interval that neither begins nor ends the clip.
    """

    spread_m: float
    cut: float
    fewest: int


def evidence(probability: Array, threshold: float) -> Array:
    """Log odds of contact over those of a threshold."""
    odds = [np.log(np.clip(p, 1e-6, 1 - 1e-6) / np.clip(1 - p, 1e-6, 1.0)) for p in (probability, threshold)]
    return np.asarray(np.clip(odds[0] - odds[1], -SURE, SURE))


def resting(evidence_: Array, places_m: Array, costs: Costs) -> tuple[Flags, float]:
    """Frames (T,) in which a point rests, and what they cost.

    Args:
        evidence_: (T,) of contact.
        places_m: (T, 3) of the point.
        costs: of intervals.
    """
    count = len(evidence_)
    local = places_m - places_m.mean(axis=0)
    sums = np.zeros((count + 1, 5))
    sums[1:] = np.cumsum(
        np.column_stack((local, np.sum(local**2, axis=1), evidence_)), axis=0
    )  # Σ x, Σ x², Σ e
    best = np.full((2, count + 1), np.inf)  # [flight, contact] that ends before a frame
    best[:, 0] = 0.0
    begin = np.zeros((2, count + 1), int)
    for end in range(1, count + 1):
        starts = _starts(end, count, costs.fewest)
        frames, gained = end - starts, sums[end] - sums[starts]  # (S,), (S, 5)
        moved = gained[:, 3] - np.sum(gained[:, :3] ** 2, axis=1) / frames
        for kind, own in enumerate((np.zeros(len(starts)), moved / costs.spread_m**2 - gained[:, 4])):
            total = best[1 - kind, starts] + own + costs.cut * (starts > 0)
            row = int(np.argmin(total))
            best[kind, end], begin[kind, end] = total[row], starts[row]
    return _traced(best, begin), float(best[:, count].min())


def _starts(end: int, count: int, fewest: int) -> Array:
    """Where an interval that ends before a frame may begin; 0 always may."""
    inner = np.arange(1, max(end - (fewest if end < count else 1), 0) + 1)
    return np.concatenate(([0], inner)).astype(int)


def _traced(best: Array, begin: Array) -> Flags:
    """The flags of the least total, from the last frame back."""
    end, flags = best.shape[1] - 1, np.zeros(best.shape[1] - 1, bool)
    kind = int(np.argmin(best[:, end]))
    while end > 0:
        start = int(begin[kind, end])
        flags[start:end] = bool(kind)
        end, kind = start, 1 - kind
    return flags
