"""Scores of networks of the synthesis on true test motions (Xie 2021, table 5, and beyond)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from simrecon.metrics import feet
from simrecon.metrics.truth import FOOT_POINTS
from simrecon.synthesis.features import CONTEXT, FUTURE, POINTS, SCORED, features, places, stand
from simrecon.synthesis.network import Network
from simrecon.types import Array
from tools.study import future_distances
from tools.train.synthesis_data import Test

SAMPLES = 10
ERRORS = ("ade", "fde", "apd")
LOOKS = ("skate", "penetration", "floating")
_SCORED, _FEET = slice(len(SCORED)), [POINTS.index(name) for name in FOOT_POINTS]
LOW_M, SUNK_M, HIGH_M = 0.05, 0.03, 0.05
"""A foot point that is nearer to the floor touches it; one so far under it is inside; a person whose lowest
foot point is always so high floats."""

Sampler = Callable[[Array], Array]
"""Features (CONTEXT, D) → futures (S, FUTURE, D)."""


def learned(network: Network, seed: int) -> Sampler:
    """DLow: one sample of each mode."""
    rng = np.random.default_rng(seed)
    return lambda context: network.sample(context, SAMPLES, rng)


def plain(network: Network, seed: int) -> Sampler:
    """The cVAE: codes drawn from N(0, I)."""
    rng = np.random.default_rng(seed)
    return lambda context: network.decode(context, rng.standard_normal((SAMPLES, network.code)))


def still(context: Array) -> Array:
    """The last pose, held."""
    frame = context[-1].copy()
    frame[-3:-1] = 0.0
    return np.tile(frame, (SAMPLES, FUTURE, 1))


def sampled(sampler: Sampler, test: Test) -> Array:
    """Futures (S, FUTURE, K, 3) in the world of a test."""
    before = test.joints_m[:CONTEXT]
    at = stand(before[-1], test.height_m)
    return places(sampler(features(before, at)), at)


def score(sampler: Sampler, tests: Sequence[Test]) -> dict[str, Array]:
    """Each score by test, (N,): `ERRORS` in m, `LOOKS` in percent."""
    rows = []
    for test in tests:
        made, true = sampled(sampler, test), test.joints_m[CONTEXT:]
        rows.append(
            (
                future_distances.ade(made[:, :, _SCORED], true[:, _SCORED]),
                future_distances.fde(made[:, :, _SCORED], true[:, _SCORED]),
                future_distances.apd(made[:, :, _SCORED]),
                *looks(made),
            )
        )
    return dict(zip((*ERRORS, *LOOKS), np.array(rows).T, strict=True))


def looks(joints_m: Array) -> tuple[float, float, float]:
    """Foot skate, penetration and floating of motions (..., F, K, 3) over a floor at z = 0, % of frames.

    Skate: a heel or toe below `LOW_M` goes faster than 0.5 m/s; penetration: one is `SUNK_M` under the floor;
    floating: all are higher than `HIGH_M` for the half second around, which no jump of these motions is.
    """
    points = joints_m[..., _FEET, :]
    low = points[..., 2] < LOW_M
    fast = feet.fast_steps(points, 1 / 30) > 0
    skate = (fast & low[..., 1:, :] & low[..., :-1, :]).any(axis=-1)
    sunk = (points[..., 2] < -SUNK_M).any(axis=-1)
    high = (points[..., 2] > HIGH_M).all(axis=-1)
    windows = np.lib.stride_tricks.sliding_window_view(high, CONTEXT, axis=-1).all(axis=-1)
    return tuple(100.0 * float(part.mean()) for part in (skate, sunk, windows))  # type: ignore[return-value]


def flat(joints_m: Array) -> Array:
    """Futures (N, F, K, 3) as vectors (N, D) of root-aligned joints, m."""
    return future_distances.aligned(joints_m[..., _SCORED, :]).reshape(len(joints_m), -1)


def nearest_m(one: Array, known: Array) -> Array:
    """Distance (N,) m of futures (N, D) from the nearest of known ones (M, D), both `flat` and in `stand`.

    It is the root of the mean square over frames and joints.
    """
    squared = (one**2).sum(1)[:, None] + np.einsum("md,md->m", known, known) - 2 * one @ known.T
    return np.asarray(np.sqrt(np.maximum(squared.min(axis=1), 0.0) / (one.shape[1] / 3)))
