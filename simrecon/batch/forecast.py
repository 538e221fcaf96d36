"""What a batch will cost: seconds, end and disk, from a measured piece of its clips or from what is done."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

STEPPING_SHARE = 0.88
"""Of a clip's time on one thread, that which threads share: by plan `quick` on one and on two of them."""


@dataclass(frozen=True)
class Cost:
    """Of a plan on this machine, on one thread, as measured.

    Attributes:
        kinematics_s: per second of video.
        first_s, window_s: of a clip's first window, and of each further one.
        bytes_per_s, fixed_bytes: of a result, by second of video and by clip.
    """

    kinematics_s: float
    first_s: float
    window_s: float
    bytes_per_s: float
    fixed_bytes: float

    def seconds(self, video_s: float, windows: int) -> float:
        """Wall time of a clip on one thread."""
        return self.kinematics_s * video_s + self.first_s + self.window_s * (windows - 1)

    def size_bytes(self, video_s: float) -> float:
        """Of a clip's result."""
        return self.fixed_bytes + self.bytes_per_s * video_s


def cost(measured: Sequence[dict[str, float]]) -> Cost:
    """The mean of several measurements, made at the same time to be as slow as in the batch."""

    def mean(name: str) -> float:
        return sum(row[name] for row in measured) / len(measured)

    return Cost(mean("kinematics_s"), mean("first_s"), mean("window_s"), mean("bytes"), mean("fixed_bytes"))


def makespan_s(seconds: Sequence[float], jobs: int, cores: int) -> float:
    """Wall time of clips, longest first, each to the job that is free first.

    Where there are fewer clips than cores, the free cores help: at best all cores are busy to the end.

    Args:
        seconds: of each clip on one thread.
        jobs: clips at once.
        cores: of the host.
    """
    if not seconds:
        return 0.0
    ends = [0.0] * max(1, min(jobs, len(seconds)))
    for item in sorted(seconds, reverse=True):
        heapq.heapreplace(ends, ends[0] + item)
    busy = max(ends)
    return max(sum(seconds) / max(cores, 1), busy - _given(ends, cores))


def _given(ends: Sequence[float], cores: int) -> float:
    """Time that the last clip gains from the cores of those that ended before (Amdahl's law)."""
    order = sorted(ends)
    if cores < len(order) or cores < 2:
        return 0.0
    tail = order[-1] - (order[-2] if len(order) > 1 else 0.0)
    return tail * STEPPING_SHARE * (1 - 1 / cores)


def total(
    groups: dict[str, tuple[Cost, list[dict[str, Any]]]], jobs: int, cores: int
) -> tuple[dict[str, float], float, float]:
    """Seconds by clip, wall time and disk of clips by plan, each with `name`, `video_s` and `windows`."""
    seconds: dict[str, float] = {}
    size = 0.0
    for model, rows in groups.values():
        for row in rows:
            seconds[row["name"]] = model.seconds(row["video_s"], row["windows"])
            size += model.size_bytes(row["video_s"])
    return seconds, makespan_s(list(seconds.values()), jobs, cores), size
