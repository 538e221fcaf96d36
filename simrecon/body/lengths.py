"""Lengths of the body: measured in the evidence, put on the skeleton, and read off a skeleton."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.body import ends, names
from simrecon.body.skeleton import rescaled, stature_m, t_pose_m, template
from simrecon.types import Array, Evidence, IntArray, Skeleton

STATED = ("skull", "mtp_rest_drop")
"""Lengths that evidence may state, beside those of `models/body/skeleton.toml`."""
STANDING_SHARE = 0.2
"""Of the frames, in which a foot is believed to stand flat: those where its ball is lowest."""


@cache
def _lengths() -> tuple[dict[str, Any], ...]:
    return tuple(resources.toml("models", "body", "skeleton.toml")["length"])


def measure(evidence: Evidence, rows: IntArray | None = None) -> dict[str, float]:
    """Lengths in the 3D estimate, m: median over frames, left and right averaged, less what noise adds.

    Noise across a bone makes it longer: of deviation σ in each direction, by about σ²/d. The spread of the
    lengths over the frames shows σ.

    Args:
        evidence: with a 3D estimate.
        rows: frames to look at, or None for all.

    Returns:
        By name of `models/body/skeleton.toml`, and `ankle_heel`, `ankle_toe`, `heel_toe`, `ankle_mtp`,
        `mtp_drop` (from the ankle down to that joint while the foot stands), `neck_skull`, `skull` (base to
        top); those that can't be measured are missing. What the evidence states goes before.
    """
    where = {
        int(point): k for k, point in enumerate(names.resolve(evidence.joint_names)) if point != names.IGNORED
    }
    index = {name: i for i, name in enumerate(template().point_names)}
    joints = evidence.joints_m if rows is None else evidence.joints_m[rows]

    def mean_of(points: list[str]) -> Array | None:
        columns = [where.get(index[name]) for name in points]
        if any(column is None for column in columns):
            return None
        return np.mean([joints[:, column] for column in columns], axis=0)  # type: ignore[no-any-return]  # (T, 3)

    def length(start: list[str], end: list[str]) -> float:
        sides = []
        for side in ("left_", "right_"):
            a, b = (mean_of([_on_side(p, side, start + end) for p in points]) for points in (start, end))
            if a is not None and b is not None and np.isfinite(a + b).any():
                sides.append(_without_noise(np.linalg.norm(a - b, axis=-1)))
        return float(np.mean(sides)) if sides else np.nan

    measured = {entry["name"]: length(entry["from"], entry["to"]) for entry in _lengths()}
    for start, end in (("ankle", "heel"), ("ankle", "toe"), ("heel", "toe"), ("ankle", "mtp")):
        measured[f"{start}_{end}"] = length([f"left_{start}"], [f"left_{end}"])
    if evidence.joints_frame == "world":
        measured["mtp_drop"] = _drop(mean_of)
    measured["neck_skull"] = length(["neck"], ["skull_base"])
    measured["skull"] = length(["skull_base"], ["head_top"])
    known = {name: value for name, value in measured.items() if np.isfinite(value) and value > 0}
    return known | dict(evidence.lengths_m)


def _drop(mean_of: Callable[[list[str]], Array | None]) -> float:
    """Height of the ankle over the joint of the big toe while that is at its lowest, m; NaN if unknown."""
    drops = []
    for side in ("left", "right"):
        ankle, mtp = mean_of([f"{side}_ankle"]), mean_of([f"{side}_mtp"])
        if ankle is None or mtp is None or not np.isfinite(ankle + mtp).any():
            continue
        low = mtp[:, 2] <= np.nanquantile(mtp[:, 2], STANDING_SHARE)
        drops.append(float(np.nanmedian(ankle[low, 2] - mtp[low, 2])))
    return float(np.mean(drops)) if drops else np.nan


def _without_noise(lengths_m: Array) -> float:
    """Median of lengths (T,), NaN where unknown, less what noise of their spread adds."""
    middle = float(np.nanmedian(lengths_m))
    spread = 1.4826 * float(np.nanmedian(np.abs(lengths_m - middle)))  # of a normal distribution
    return float(np.sqrt(max(middle**2 - 2 * spread**2, 0.5 * middle**2)))


def _on_side(point: str, side: str, points: list[str]) -> str:
    """The point on the other side, unless the length goes across the body."""
    across = any(p.startswith("right_") for p in points)
    return point if across else point.replace("left_", side, 1)


def scaled(
    lengths_m: dict[str, float], height_m: float | None = None, stature_default_m: float = 1.7
) -> Skeleton:
    """The template with measured lengths, and, where the person's height is known, scaled to it as a whole.

    Args:
        lengths_m: from `measure`; may be empty.
        height_m: of the person, or None.
        stature_default_m: where neither height nor any length is known.
    """
    unit = template()
    expected = measure_template(unit)
    ratios = {name: lengths_m[name] / expected[name] for name in expected if name in lengths_m}
    if "head" not in ratios and "neck_skull" in lengths_m:
        neck = float(np.linalg.norm(unit.offsets_m[unit.names.index("head")]))
        ratios["head"] = lengths_m["neck_skull"] / neck
    overall = float(np.median(list(ratios.values()))) if ratios else (height_m or stature_default_m)
    offsets = unit.offsets_m * overall
    points = unit.point_offsets_m * overall
    order = {name: i for i, name in enumerate(unit.names)}
    for entry in _lengths():
        ratio = ratios.get(entry["name"], ratios.get(entry.get("fallback", ""), overall))
        for target in entry["scales"]:
            joint, axis = target.split(".")
            for side in {joint, joint.replace("left_", "right_", 1)}:
                row, column = order[side], "xyz".index(axis)
                offsets[row, column] = unit.offsets_m[row, column] * ratio
    head, feet = ends.head_ratio(unit, lengths_m, ratios, overall), ends.feet(unit, lengths_m, overall)
    for row, name in enumerate(unit.point_names):
        if unit.names[unit.point_segments[row]] == "head":
            points[row] = unit.point_offsets_m[row] * head
        elif name.endswith(("_heel", "_toe", "_mtp")):
            which = name.split("_")[1]
            usual = feet.get(which, points[row])
            is_end = which != "mtp"
            points[row] = ends.foot_point(which, lengths_m, overall, usual) if is_end else usual
    skeleton = replace(unit, offsets_m=offsets, point_offsets_m=points)
    return skeleton if height_m is None else rescaled(skeleton, height_m / stature_m(skeleton))


def stated_lengths() -> tuple[str, ...]:
    """Names of the lengths that evidence may state."""
    return (*(entry["name"] for entry in _lengths()), *STATED)


def bone_names() -> tuple[str, ...]:
    """Names of the lengths along which nothing bends."""
    return tuple(entry["name"] for entry in _lengths() if entry.get("bone"))


def length_names() -> tuple[str, ...]:
    """Names of the lengths that scale an offset, L of them."""
    return tuple(entry["name"] for entry in _lengths() if entry["scales"])


def length_offsets(skeleton: Skeleton) -> Array:
    """The part of each joint's offset that is proportional to a length, (L, 17, 3) m."""
    order = {name: i for i, name in enumerate(skeleton.names)}
    names = length_names()
    parts = np.zeros((len(names), *skeleton.offsets_m.shape))
    for entry in _lengths():
        for target in entry["scales"]:
            joint, axis = target.split(".")
            for side in {joint, joint.replace("left_", "right_", 1)}:
                row, column = order[side], "xyz".index(axis)
                parts[names.index(entry["name"]), row, column] = skeleton.offsets_m[row, column]
    return parts


def length_shares(skeleton: Skeleton) -> Array:
    """By how much stature grows as a length does, both as natural logarithms, (L,)."""
    chain = [skeleton.names.index(name) for name in ("spine", "chest", "neck", "head")]
    legs = [skeleton.names.index(name) for name in ("left_knee", "left_ankle")]
    heights = length_offsets(skeleton)[..., 2]  # (L, 17)
    return np.asarray((heights[:, chain].sum(axis=1) - heights[:, legs].sum(axis=1)) / stature_m(skeleton))


def measure_template(skeleton: Skeleton) -> dict[str, float]:
    """The lengths of `measure` on a skeleton in T-pose, m."""
    places = t_pose_m(skeleton)[skeleton.point_segments] + skeleton.point_offsets_m  # (M, 3)
    at = dict(zip(skeleton.point_names, places, strict=True))
    lengths = {}
    for entry in _lengths():
        start, end = (np.mean([at[point] for point in entry[key]], axis=0) for key in ("from", "to"))
        lengths[entry["name"]] = float(np.linalg.norm(end - start))
    return lengths
