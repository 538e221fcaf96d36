"""Scores in the rows of a suite's runs: of one run, and their means over seeds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

Row = dict[str, Any]
RUN = "run"
"""The motion whose scores are what a run says of itself."""


def value(run: Row, motion: str, score: str) -> float:
    """A score of a run; NaN if it has none."""
    if run["status"] == "failed":
        return math.nan
    scores = run["run"] if motion == RUN else run["scores"].get(motion, {})
    return float(scores.get(score, math.nan))


def over_seeds(runs: Iterable[Row], clip: str, variant: str, motion: str, score: str) -> float:
    """Mean over the seeds of a clip's variant that have the score; NaN if none has."""
    chosen = [run for run in runs if run["clip"] == clip and run["variant"] == variant]
    return mean(value(run, motion, score) for run in chosen)


def mean(values: Iterable[float]) -> float:
    """Of the finite ones; NaN if there is none."""
    known = [finite for finite in values if math.isfinite(finite)]
    return float(np.mean(known)) if known else math.nan
