"""Left and right that were mixed up in some frames of any evidence, and put in order.

An exchange turns the sign of the difference d between the left and the right point of a pair, and leaves
their middle alone. So of the signs s_t = ±1 of each frame those are sought whose second differences
s_t d_t - 2 s_{t-1} d_{t-1} + s_{t-2} d_{t-2} are least, each in units of its pair's usual one and capped,
with a price per exchange and per exchanged frame (Viterbi). Limbs that cross swing on and are left alone.
Arms and legs, 2D landmarks and the 3D estimate are looked at by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array, Evidence, IntArray

LIMBS = {
    "arms": ("shoulder", "elbow", "wrist", "hand", "pinky", "index", "thumb"),
    "legs": ("hip", "knee", "ankle", "heel", "toe", "foot_index", "big_toe", "small_toe"),
}
KINDS = ("2D", "3D")
SCORE_MIN = 0.1
GAP_MAX_S = 0.2  # across a longer one nothing is known
CAP = 25.0  # squared second differences are no worse than five times the usual one
# In usual squared second differences; one exchange of sides that are clearly apart saves two caps.
TURN_COST, FRAME_COST = 3.0, 0.5
# Usual second differences are not below this share of the usual distance of the two sides.
LEAST_SHARE = 0.05


@dataclass(frozen=True, eq=False)
class Sides:
    """Frames in which left and right were exchanged; (2, T) each for 2D landmarks and 3D estimate.

    Attributes:
        arms, legs: True where they were mixed up.
    """

    arms: NDArray[np.bool_]
    legs: NDArray[np.bool_]

    def as_dict(self) -> dict[str, IntArray]:
        """Frames by limbs and kind, such as `legs 2D`; only where there are any."""
        mixed = {
            f"{name} {kind}": np.flatnonzero(getattr(self, name)[k])
            for name in LIMBS
            for k, kind in enumerate(KINDS)
        }
        return {name: frames for name, frames in mixed.items() if len(frames)}


def find(evidence: Evidence) -> Sides:
    """The frames in which left and right of arms or legs were mixed up."""
    weights = np.where(evidence.scores >= SCORE_MIN, evidence.scores, 0.0)
    known = np.asarray(np.isfinite(evidence.joints_m).all(axis=2), np.float64)
    mixed = {}
    for name in LIMBS:
        seen = _mixed(evidence.times_s, evidence.keypoints_px, weights, pairs(evidence.keypoint_names, name))
        estimated = _mixed(evidence.times_s, evidence.joints_m, known, pairs(evidence.joint_names, name))
        mixed[name] = np.stack((seen, estimated))
    return Sides(**mixed)


def in_order(evidence: Evidence) -> Evidence:
    """The evidence with left and right put in order; the same object where they are."""
    mixed = find(evidence)
    if not mixed.as_dict():
        return evidence
    points, scores, joints = evidence.keypoints_px.copy(), evidence.scores.copy(), evidence.joints_m.copy()
    for name in LIMBS:
        seen, estimated = getattr(mixed, name)
        for values, rows, names in (
            (points, seen, evidence.keypoint_names),
            (scores, seen, evidence.keypoint_names),
            (joints, estimated, evidence.joint_names),
        ):
            index = pairs(names, name)
            at = np.flatnonzero(rows)[:, None]
            values[at, index.ravel()] = values[at, index[:, ::-1].ravel()]
    return replace(evidence, keypoints_px=points, scores=scores, joints_m=joints)


def pairs(names: tuple[str, ...], limbs: str) -> IntArray:
    """Columns (P, 2) of left and right points of `arms` or `legs`."""
    at = {name: column for column, name in enumerate(names)}
    both = [(f"left_{part}", f"right_{part}") for part in LIMBS[limbs]]
    columns = [(at[left], at[right]) for left, right in both if left in at and right in at]
    return np.array(columns, np.int64).reshape(-1, 2)


def _mixed(times_s: Array, values: Array, weights: Array, index: IntArray) -> NDArray[np.bool_]:
    """Frames (T,) with the sides exchanged; values (T, N, C), weights (T, N), index (P, 2)."""
    result = np.zeros(len(times_s), bool)
    known = np.isfinite(values[:, index]).all(axis=-1)
    weight = np.where(known, weights[:, index], 0.0).min(axis=-1)  # (T, P)
    seen = np.flatnonzero(weight.any(axis=1))
    if len(seen) < 3:
        return result
    across = np.nan_to_num(values[seen][:, index[:, 0]] - values[seen][:, index[:, 1]])  # (S, P, C)
    linked = np.diff(times_s[seen]) <= GAP_MAX_S  # (S - 1,)
    trust = np.minimum(np.minimum(weight[seen][2:], weight[seen][1:-1]), weight[seen][:-2])
    trust *= (linked[1:] & linked[:-1])[:, None]  # (S - 2, P)
    result[seen] = _signs(_costs(across, trust))
    return result


def _costs(across: Array, trust: Array) -> Array:
    """Mean capped second difference (S - 2, 2, 2): the first, the last frame exchanged against the middle."""
    turns = (1.0, -1.0)
    ends = [[a * across[:-2] + b * across[2:] for b in turns] for a in turns]
    size = np.sum((np.array(ends) - 2 * across[1:-1]) ** 2, axis=-1)  # (2, 2, S - 2, P)
    usual = np.median(size[0, 0], axis=0)  # (P,)
    least = LEAST_SHARE**2 * np.median(np.sum(across**2, axis=-1), axis=0)
    capped = np.minimum(size / np.maximum(np.maximum(usual, least), 1e-12), CAP)
    mean = np.sum(capped * trust, axis=-1) / np.maximum(trust.sum(axis=-1), 1e-9)  # (2, 2, S - 2)
    return np.moveaxis(mean, -1, 0)


def _signs(costs: Array) -> NDArray[np.bool_]:
    """The states (S,) of least cost, True = exchanged."""
    states = np.arange(2)
    turned = states[:, None] != states  # (before, after)
    price = TURN_COST * turned + FRAME_COST * states
    best = FRAME_COST * states[:, None] + price  # (s of frame t - 1, s of frame t), so far
    # cost of three states, (before, middle, after)
    which = (turned[:, :, None].astype(int), turned.T[None].astype(int))
    back = np.zeros((len(costs), 2, 2), np.int64)
    for t, cost in enumerate(costs):
        total = best[:, :, None] + cost[which] + price[None]
        back[t] = total.argmin(axis=0)
        best = total.min(axis=0)
    exchanged = np.zeros(len(costs) + 2, bool)
    middle, last = np.unravel_index(int(best.argmin()), (2, 2))
    for t in range(len(costs) - 1, -1, -1):
        exchanged[t + 2] = last
        middle, last = back[t, middle, last], middle
    exchanged[1], exchanged[0] = last, middle
    return exchanged
