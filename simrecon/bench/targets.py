"""What the targets of a suite come to; pure functions of the rows of its runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from simrecon.bench.rows import Row, mean, over_seeds
from simrecon.bench.schema import Bound, Suite, Target


def verdicts(suite: Suite, runs: Sequence[Row]) -> list[Row]:
    """What each target comes to, with the first variant.

    Returns:
        `text`, `must`, `reach` (each a list of `measure`, `limit`, `value`, `met`), `met_must`, `met_reach`
        (None without bounds or values) and `worst_clip`.
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
    if np.isfinite(own).any():
        row["worst_clip"] = clips[int(np.nanargmax(own))]
    return row


def _judge(bound: Bound, own: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> Row:
    """A bound's value over clips, and whether it is met."""
    both = np.isfinite(own) & np.isfinite(other) & (other > 0)
    known, ratios = own[np.isfinite(own)], own[both] / other[both]
    measures = {
        "mean": mean(own),
        "worst": max(known, default=math.nan),
        "least": min(known, default=math.nan),
        "ratio": mean(own[both]) / mean(other[both]) if both.any() else math.nan,
        "worst_ratio": max(ratios, default=math.nan),
    }
    measured = float(measures[bound.measure])
    limits = [f"≤ {bound.at_most:g}"] if bound.at_most is not None else []
    limits += [f"≥ {bound.at_least:g}"] if bound.at_least is not None else []
    met = None
    if math.isfinite(measured):
        low = -math.inf if bound.at_least is None else bound.at_least
        high = math.inf if bound.at_most is None else bound.at_most
        met = bool(low <= measured <= high)
    return {
        "measure": bound.measure,
        "limit": " and ".join(limits),
        "value": measured if math.isfinite(measured) else None,
        "met": met,
    }
