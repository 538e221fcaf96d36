"""How well a pose prior tells recorded poses from spoilt ones: ROC curves, and norms by activity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.stats import rankdata

from simrecon import body as bodies
from simrecon.geometry import rotations
from simrecon.types import Array, IntArray
from tools.train.prior_data import TEST_SUBJECT, Poses, balanced

COUNT, TURN_RAD, WRONG_RAD = 5000, np.radians(30), np.radians(20)
# The axis about which a hinge that is past straight has turned, from the T-pose; the bone's own axis.
_HINGES = {
    "left_knee": ((0, -1, 0), 2), "right_knee": ((0, -1, 0), 2),
    "left_elbow": ((0, 0, 1), 1), "right_elbow": ((0, 0, -1), 1),
}  # fmt: skip


def turned(rotvecs: Array, rng: np.random.Generator, angle_rad: float) -> tuple[Array, IntArray]:
    """Poses (N, 16, 3) with one joint turned about a random axis, and which."""
    count, rows = len(rotvecs), np.arange(len(rotvecs))
    joint = rng.integers(0, 16, count)
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    changed = rotvecs.copy()
    q = rotations.multiply(rotations.exp(rotvecs[rows, joint]), rotations.exp(angle_rad * axis))
    changed[rows, joint] = rotations.log(q)
    return changed, joint


def wrong_way(rotvecs: Array, rng: np.random.Generator, angle_rad: float) -> tuple[Array, IntArray]:
    """Poses (N, 16, 3) with a knee or an elbow bent past straight, its twist kept, and which."""
    skeleton = bodies.template()
    names, count, rows = skeleton.names[1:], len(rotvecs), np.arange(len(rotvecs))
    pick = rng.integers(0, len(_HINGES), count)
    joint = np.array([names.index(name) for name in _HINGES])[pick]
    axis = np.array([axis for axis, _ in _HINGES.values()], float)[pick]
    along = np.eye(3)[[bone for _, bone in _HINGES.values()]][pick]
    rest = skeleton.rest[1:][joint]
    q = rotations.multiply(rest, rotations.exp(rotvecs[rows, joint]))  # from the T-pose
    twist = rotations.canonical(np.concatenate((q[:, :1], q[:, 1:] * along), axis=1))
    bent = rotations.multiply(rotations.exp(angle_rad * axis), twist)
    changed = rotvecs.copy()
    changed[rows, joint] = rotations.log(rotations.multiply(rotations.conjugate(rest), bent))
    return changed, joint


def auc(low: Array, high: Array) -> float:
    """Area under the ROC curve of telling `high` from `low` by a threshold (Mann and Whitney's U)."""
    ranks = rankdata(np.concatenate((low, high)))[len(low) :]
    return float((ranks.sum() - len(high) * (len(high) + 1) / 2) / (len(low) * len(high)))


def report(norm: Callable[[Array], Array], data: dict[str, Poses]) -> dict[str, object]:
    """All figures of a prior; `norm` maps rotation vectors (N, 16, 3) to (N,)."""
    rng = np.random.default_rng(0)
    test = data["test"]
    row = balanced(test, COUNT, rng)
    usual = test.rotvecs[row]
    spoilt, joint = turned(usual, rng, TURN_RAD)
    bent, hinge = wrong_way(usual, rng, WRONG_RAD)
    low, high, past = norm(usual), norm(spoilt), norm(bent)
    stranger = np.char.startswith(test.clips[row], f"{TEST_SUBJECT}_")
    names = bodies.template().names[1:]
    walk = float(np.median(norm(test.rotvecs[test.activities == "walk"])))
    hard = data["acrobatics"]
    ratios = {
        name: float(np.median(norm(hard.rotvecs[hard.clips == name]))) / walk
        for name in np.unique(hard.clips)
    }
    by_activity = {
        str(kind): round(float(np.median(norm(test.rotvecs[test.activities == kind]))), 2)
        for kind in np.unique(test.activities)
    }
    return {
        "turned 30 deg": round(auc(low, high), 4),
        "turned 30 deg, new subject": round(auc(low[stranger], high[stranger]), 4),
        "turned 30 deg, known subjects": round(auc(low[~stranger], high[~stranger]), 4),
        "turned 30 deg by joint": {n: round(auc(low, high[joint == i]), 3) for i, n in enumerate(names)},
        "wrong way 20 deg": round(auc(low, past), 4),
        "wrong way 20 deg by joint": {n: round(auc(low, past[hinge == names.index(n)]), 3) for n in _HINGES},
        "acrobatics over walking": round(float(np.median(norm(hard.rotvecs))) / walk, 3),
        "by clip": {str(name): round(ratio, 3) for name, ratio in ratios.items()},
        "median norm": by_activity,
    }
