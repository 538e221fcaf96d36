"""Which of two passes over the same frames saw the person better, that forward or that backward in time.

The network is as sure of limbs that it makes up as of those that it sees. But what it makes up jumps from
frame to frame, while a body goes on. So of both poses of each frame those are taken that make the least of

    Σ_t UNCLEAR (1 - clarity) + colours_off + CHANGES · change(t - 1, t) + jump(t - 1, t)

with the distance of the colours from those that are remembered, the mean distance of the landmarks from one
frame to the next (jump), and what remains of it after a similarity transform (change), both in sides of the
region. It is found by dynamic programming (Viterbi).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.video.blazepose import Pose
from simrecon.evidence.video.figures import BODY, clarity
from simrecon.types import Array

APART_MAX = 0.08
"""Mean distance of the landmarks up to which two poses of a frame are one, in sides of the region."""
UNCLEAR, CHANGES = 0.3, 2.0


@dataclass(frozen=True, eq=False)
class Option:
    """A pose that may be the person's, and the distance of its colours."""

    pose: Pose
    off: float


def agree(a: Pose, b: Pose) -> bool:
    """Whether two poses of a frame are the same."""
    return jump(a, b) <= APART_MAX


def jump(a: Pose, b: Pose) -> float:
    """Mean distance of the landmarks of two poses, in sides of the region."""
    off = np.linalg.norm(a.points_px[list(BODY)] - b.points_px[list(BODY)], axis=1).mean()
    return float(off) / max(min(a.region.side_px, b.region.side_px), 1e-6)


def change(a: Pose, b: Pose) -> float:
    """How much a body changes between two poses, but for place, size and turn, in sides of the region."""
    first, second = (one.points_px[list(BODY)] @ np.array([1.0, 1j]) for one in (a, b))  # (B,) complex
    first, second = first - first.mean(), second - second.mean()
    turn = np.vdot(first, second) / max(float(np.vdot(first, first).real), 1e-12)
    return float(np.abs(second - turn * first).mean()) / max(b.region.side_px, 1e-6)


def best(options: Sequence[Sequence[Option]]) -> NDArray[np.int64]:
    """Which option of each frame is taken.

    Args:
        options: of each frame, in order of time; none: nobody is seen.

    Returns:
        (T,) indices, -1 where there is none.
    """
    result = np.full(len(options), -1, np.int64)
    total, back = np.zeros(0), list[NDArray[np.int64]]()
    for t, here in enumerate(options):
        before = options[t - 1] if t else ()
        via = total[:, None] + _steps(before, here) if len(before) else np.zeros((1, len(here)))
        back.append(via.argmin(axis=0) if len(here) else np.zeros(0, np.int64))
        total = np.array([via[:, k].min() + _cost(one) for k, one in enumerate(here)])
        if len(here) and (t + 1 == len(options) or not options[t + 1]):  # the end of frames in a row
            result[t] = int(total.argmin())
            for s in range(t, 0, -1):
                if not options[s - 1]:
                    break
                result[s - 1] = back[s][result[s]]
    return result


def _cost(one: Option) -> float:
    return UNCLEAR * (1 - clarity(one.pose)) + one.off


def _steps(before: Sequence[Option], here: Sequence[Option]) -> Array:
    """Costs (N, M) of going from N options of a frame to M of the next."""
    return np.array([[CHANGES * change(a.pose, b.pose) + jump(a.pose, b.pose) for b in here] for a in before])
