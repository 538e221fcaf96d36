"""Numbers of docs/results/synthesis.md, from what `tools.study.synthesis` measured."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.types import Array

RESAMPLES = 4000


def values(known: dict[str, Any], kind: str, sampler: str, score: str) -> Array:
    """(seeds, tests) of a score."""
    return np.array([known["scores"][f"{kind} {seed}"][sampler][score] for seed in range(known["seeds"])])


def pair(known: dict[str, Any], sampler: str, other: str, score: str) -> tuple[Array, Array]:
    """A score of what was trained on simulations, and on another kind of data."""
    return values(known, "simulation", sampler, score), values(known, other, sampler, score)


def interval(known: dict[str, Any], ours: Array, theirs: Array) -> tuple[float, float]:
    """95 % interval (%) of a relative difference, over draws of the test motions."""
    names = np.array(known["test_names"])
    motions = sorted(set(names.tolist()))
    sums = np.array(
        [[part.mean(axis=0)[names == name].sum() for name in motions] for part in (ours, theirs)]
    )  # (2, motions)
    rng = np.random.default_rng(0)
    drawn = sums[:, rng.integers(0, len(motions), (RESAMPLES, len(motions)))].sum(axis=2)
    low, high = np.percentile(100 * (drawn[0] / drawn[1] - 1), [2.5, 97.5])
    return float(low), float(high)


def apart(ours: Array, theirs: Array, score: str) -> str:
    """`better` or `worse` where every seed of the one is so than every seed of the other, else `no`."""
    sign = 1 if score == "apd" else -1
    one, other = sign * ours.mean(axis=1), sign * theirs.mean(axis=1)
    return "better" if one.min() > other.max() else "worse" if one.max() < other.min() else "no"


def ended(known: dict[str, Any], *, balanced: bool) -> tuple[int, int]:
    """How many futures a simulation followed to the end, of how many; of all, or of those in balance."""
    run = [row for row in known["simulated"] if "to_the_end" in row and (row["balanced"] or not balanced)]
    return sum(row["to_the_end"] for row in run), len(run)
