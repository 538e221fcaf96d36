"""Scores that are means over frames, and their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from simrecon.types import Array

BLOCK_S = 0.5
"""Length of a block: poses half a second apart are nearly independent, neighbours are not."""
SAMPLES = 1000
LEVEL = 0.95


@dataclass(frozen=True, eq=False)
class Series:
    """A score that is a ratio of sums over frames: value = power(Σ numerator / Σ weight).

    Attributes:
        numerator: (T,), 0 where the weight is 0.
        weight: (T,).
        root: take the square root of the ratio (root mean squared errors).
    """

    numerator: Array
    weight: Array
    root: bool = False

    @property
    def value(self) -> float:
        """The score; NaN if nothing counts."""
        total = float(self.weight.sum())
        ratio = float(self.numerator.sum()) / total if total > 0 else float("nan")
        return float(np.sqrt(ratio)) if self.root else ratio


def of_frames(
    values: NDArray[Any], counted: NDArray[np.bool_] | None = None, *, scale: float = 1.0, root: bool = False
) -> Series:
    """The mean of values (T, ...) over all axes as a `Series`; NaN, and what is not counted, is left out.

    Args:
        values: (T, ...).
        counted: (T, ...) of True where a value counts, or None for all.
        scale: unit of the score.
        root: as in `Series`; the scale is then of the square.
    """
    known = np.isfinite(values) if counted is None else np.isfinite(values) & counted
    axes = tuple(range(1, values.ndim))
    numerator = np.where(known, values, 0.0).sum(axes) * scale
    return Series(np.asarray(numerator), np.asarray(known.sum(axes), dtype=np.float64), root)


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of one motion.

    Attributes:
        series: those that are means over frames, which have intervals.
        numbers: the others.
    """

    series: dict[str, Series] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float]:
        """All scores that are known, by name."""
        values = {name: series.value for name, series in self.series.items()} | self.numbers
        return {name: value for name, value in values.items() if np.isfinite(value)}

    def __or__(self, other: Scores) -> Scores:
        """Both together."""
        return Scores(self.series | other.series, self.numbers | other.numbers)


def interval(
    series: Series,
    block_frames: int,
    rng: np.random.Generator,
    *,
    samples: int = SAMPLES,
    level: float = LEVEL,
) -> tuple[float, float]:
    """Bootstrap interval of a score over frames in blocks.

    Circular block bootstrap (Politis & Romano 1992): frames are drawn in runs of consecutive ones, so that
    their correlation stays. The limits are expanded percentiles (Hesterberg 2015, section 3.3), with the
    number of blocks as the sample size, since plain percentiles of few blocks are too narrow. The same
    generator state draws the same frames for every series of the same length, so that methods are compared on
    the same resamples.

    Args:
        series: T frames.
        block_frames: length of a block, at most a quarter of the series.
        rng: of the draws.
        samples: number of resamples.
        level: of the interval.

    Returns:
        Lower and upper limit; NaN if nothing counts.
    """
    frames = len(series.weight)
    if not series.weight.any():
        return float("nan"), float("nan")
    block = int(np.clip(block_frames, 1, max(1, frames // 4)))
    starts = rng.integers(frames, size=(samples, -(-frames // block)))  # (S, blocks)
    rows = (starts[..., None] + np.arange(block)).reshape(samples, -1)[:, :frames] % frames  # (S, T)
    total, weight = series.numerator[rows].sum(1), series.weight[rows].sum(1)  # (S,)
    ratios = total[weight > 0] / weight[weight > 0]
    if not len(ratios):
        return float("nan"), float("nan")
    count = max(2.0, frames / block)
    student = scipy.special.stdtrit(count - 1, 0.5 * (1.0 + level))
    tail = 100.0 * scipy.special.ndtr(-np.sqrt(count / (count - 1)) * student)
    low, high = np.percentile(np.sqrt(ratios) if series.root else ratios, (tail, 100.0 - tail))
    return float(low), float(high)


def intervals(
    scores: Mapping[str, Series], duration_s: float, *, seed: int = 0, block_s: float = BLOCK_S
) -> dict[str, tuple[float, float]]:
    """`interval` of each score of a clip; those of the same rate are drawn on the same resamples.

    Args:
        scores: by name, each at its own rate over the whole clip.
        duration_s: of the clip.
        seed: of the draws.
        block_s: length of a block.
    """
    share = block_s / duration_s
    return {
        name: interval(series, round(share * len(series.weight)), np.random.default_rng(seed))
        for name, series in scores.items()
    }
