"""What the targets of a suite come to; pure functions of the rows of its runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from simrecon.bench.rows import Row, mean, over_seeds
from simrecon.bench.schema import Bound, Suite, Target

Values = np.ndarray[Any, Any]
"""Of a score, by clip; NaN where it is not known."""
LEAST_DIGITS, MOST_DIGITS = 3, 15


def verdicts(suite: Suite, runs: Sequence[Row]) -> list[Row]:
    """What each target comes to, with the first variant.

    Returns:
        `text`, `must`, `reach` (each a list of `measure`, `limit`, `value`, `shown`, `met`), `met_must`,
        `met_reach` (None without bounds or values) and `worst_clip`, by the measure of the first bound.
    """
    return [_target(suite, target, runs) for target in suite.target]


def _target(suite: Suite, target: Target, runs: Sequence[Row]) -> Row:
    variant = suite.variant[0].name
    clips = target.clips or tuple(clip.name for clip in suite.clip)
    own, other = (
        np.array([over_seeds(runs, whose or clip, variant, motion, target.score) for clip in clips])
        for motion, whose in ((target.of, None), (target.against, target.against_clip))
    )
    row: Row = {"text": target.text, "score": target.score}
    for level, bounds in (("must", target.must), ("reach", target.reach)):
        judged = [_judge(bound, own, other) for bound in bounds]
        known = [bound["met"] for bound in judged if bound["met"] is not None]
        row[level] = judged
        row[f"met_{level}"] = any(known) if known else None
    first = next(iter((*target.must, *target.reach)), None)
    badness = np.full(len(clips), math.nan) if first is None else _badness(first, own, other)
    if np.isfinite(badness).any():
        row["worst_clip"] = clips[int(np.nanargmax(badness))]
    return row


def _badness(bound: Bound, own: Values, other: Values) -> Values:
    """How near each clip comes to breaking a bound, the greater the worse; NaN where it has no value."""
    values = own
    if bound.measure in ("ratio", "worst_ratio"):
        known = np.isfinite(own) & np.isfinite(other) & (other > 0)
        values = np.where(known, own / np.where(known, other, 1.0), math.nan)
    elif bound.measure == "gain":
        values = own - other
    return values if bound.at_most is not None else -values


def _judge(bound: Bound, own: Values, other: Values) -> Row:
    """A bound's value over clips, and whether it is met."""
    both = np.isfinite(own) & np.isfinite(other) & (other > 0)
    known, ratios = own[np.isfinite(own)], own[both] / other[both]
    pair = np.isfinite(own) & np.isfinite(other)
    measures = {
        "mean": mean(own),
        "worst": max(known, default=math.nan),
        "least": min(known, default=math.nan),
        "ratio": mean(own[both]) / mean(other[both]) if both.any() else math.nan,
        "worst_ratio": max(ratios, default=math.nan),
        "gain": mean(own[pair] - other[pair]),
    }
    measured = float(measures[bound.measure])
    limits = [f"≤ {bound.at_most:g}"] if bound.at_most is not None else []
    limits += [f"≥ {bound.at_least:g}"] if bound.at_least is not None else []
    low = -math.inf if bound.at_least is None else bound.at_least
    high = math.inf if bound.at_most is None else bound.at_most
    met = bool(low <= measured <= high) if math.isfinite(measured) else None
    return {
        "measure": bound.measure,
        "limit": " and ".join(limits),
        "value": measured if math.isfinite(measured) else None,
        "shown": _shown(measured, low, high),
        "met": met,
    }


def _shown(value: float, low: float, high: float) -> str | None:
    """A value with as many digits as tell on which side of its limits it lies; None where it is not known."""
    if not math.isfinite(value):
        return None
    texts = [f"{value:.{digits}g}" for digits in range(LEAST_DIGITS, MOST_DIGITS + 1)]
    return next((t for t in texts if (low <= float(t) <= high) == (low <= value <= high)), texts[-1])
