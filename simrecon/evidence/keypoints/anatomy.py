"""Which layout a person's landmarks are in, by the proportions of the body.

For each pair of neighbouring points the median over frames of the ratio r = d / (L D) is looked at: d is
their distance, L that of the template in statures, D the diagonal of the person in the same frame.
Foreshortening only makes r smaller, so in the right layout none is far above the others; in a wrong one a few
points that lie near each other on the body lie far apart in the file.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from simrecon.body import names as body_names
from simrecon.body.skeleton import t_pose_m, template
from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import layouts
from simrecon.types import Array

PAIRS = (
    ("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist"), ("left_hip", "left_knee"),
    ("left_knee", "left_ankle"), ("left_shoulder", "left_hip"), ("left_shoulder", "right_shoulder"),
    ("left_hip", "right_hip"), ("left_eye", "nose"), ("left_eye", "left_ear"), ("left_eye", "right_eye"),
    ("nose", "neck"), ("left_ankle", "left_heel"), ("left_ankle", "left_toe"), ("neck", "left_shoulder"),
    ("neck", "head_top"), ("neck", "skull_base"), ("skull_base", "head_top"), ("pelvis", "left_hip"),
    ("chest", "pelvis"), ("chest", "neck"), ("left_ear", "head_top"),
)  # fmt: skip
"""Points that are neighbours; those of the right side are the mirror image."""

PAIRS_MIN = 4
# Of a person who is seen whole r is at most about 1.3, of one who is seen in part about 1.5 times its median.
WHOLE_MAX, PART_MAX = 1.3, 1.5
# Means of log(r / limit) over the pairs, 0 where r is below it. On 15 recordings (walking, rolling, standing
# up, dancing, punching, a somersault) in each layout, the right one has at most 0.07 (whole) and 0.01 (part);
# the others have at least 0.05 more in the one, or 0.03 in the other.
PART_GAP, WHOLE_GAP = 0.03, 0.03
PART_WRONG, WHOLE_WRONG = 0.04, 0.25


def decide(
    content: Content, order: layouts.Order, points: Array, choice: str | None = None
) -> tuple[tuple[str, ...], str]:
    """Names of a person's landmarks.

    Args:
        content: the file, for messages.
        order: which layouts may be meant.
        points: (T, J, 2 or 3) of one person, NaN = not seen.
        choice: of the user.

    Returns:
        The names, and the layout where others have as many landmarks.

    Raises:
        InputError: the points are no person in any of the layouts, or in more than one.
    """
    candidates = layouts.by_count(content, order, points.shape[1], choice)
    if choice is not None:
        return layouts.layout(choice), f"in the order of {choice} as given"
    strains = {name: strain(points, layouts.layout(name)) for name in candidates}
    known = {name: value for name, value in strains.items() if value is not None}
    if len(candidates) == 1 and not known:
        return layouts.layout(candidates[0]), ""
    least = min((part for _, part in known.values()), default=np.inf)
    near = sorted((whole, name) for name, (whole, part) in known.items() if part <= least + PART_GAP)
    same = (name for name in layouts.all_names() if len(layouts.layout(name)) == points.shape[1])
    valid = f"--layout {', '.join(same)}"
    if len(known) < len(candidates) or (len(near) > 1 and near[1][0] - near[0][0] < WHOLE_GAP):
        text = f"{points.shape[1]} landmarks that could be in more than one order"
        raise content.fail(order.key, text, valid)
    whole, name = near[0]
    if whole > WHOLE_WRONG and known[name][1] > PART_WRONG:
        text = f"{points.shape[1]} landmarks that make no person in the order of {' or '.join(candidates)}"
        raise content.fail(order.key, text, valid)
    others = [other for other in candidates if other != name]
    note = f"in the order of {name}, by the person's proportions (not {', '.join(others)})" if others else ""
    return layouts.layout(name), note


def doubt(points: Array, names: Sequence[str]) -> str:
    """A word on landmarks with names that hardly make a person."""
    value = strain(points, names)
    odd = value is not None and value[0] > WHOLE_WRONG and value[1] > PART_WRONG
    return "by these names they hardly make a person: are they in another order?" if odd else ""


def strain(points: Array, names: Sequence[str]) -> tuple[float, float] | None:
    """How far points (T, J, 2 or 3) of these names are from a person's proportions, 0 where they fit.

    Returns:
        For a person seen whole, and for one seen in part; None if too few points are seen to tell.
    """
    seen = np.asarray(np.isfinite(points).all(axis=-1))  # (T, J)
    size = sizes(points)  # (T,)
    at = {name: i for i, name in enumerate(canonical(names)) if name}
    ratios = []
    for (one, other), length in _lengths().items():
        if one in at and other in at:
            both = seen[:, at[one]] & seen[:, at[other]] & (size > 0)
            if both.any():
                far = np.linalg.norm(points[both, at[one]] - points[both, at[other]], axis=-1)
                ratios.append(float(np.median(far / (length * size[both]))))
    if len(ratios) < PAIRS_MIN:
        return None
    whole, part = (_above(np.array(ratios), limit) for limit in (WHOLE_MAX, _part_limit(ratios)))
    return whole, part


def sizes(points: Array) -> Array:
    """Diagonals (T,) of the boxes around points (T, J, 2 or 3), 0 where none is seen."""
    seen = np.asarray(np.isfinite(points).all(axis=-1))  # (T, J)
    low = np.where(seen[..., None], points, np.inf).min(axis=1)
    high = np.where(seen[..., None], points, -np.inf).max(axis=1)
    some = np.asarray(seen.any(axis=1))
    return np.asarray(np.linalg.norm(np.where(some[:, None], high - low, 0.0), axis=-1))


def canonical(names: Sequence[str]) -> tuple[str, ...]:
    """The points of the body that landmarks are, by their own names; `""` for those that are none."""
    index = body_names.resolve(name for name in names if name)
    points = iter(index)
    listed = [next(points) if name else body_names.IGNORED for name in names]
    return tuple("" if k == body_names.IGNORED else str(body_names.points()[k]["name"]) for k in listed)


def _part_limit(ratios: Sequence[float]) -> float:
    return max(WHOLE_MAX, PART_MAX * float(np.median(ratios)))


def _above(ratios: Array, limit: float) -> float:
    return float(np.log(np.maximum(ratios, limit) / limit).mean())


@cache
def _lengths() -> dict[tuple[str, str], float]:
    """Lengths of the pairs, in statures."""
    body = template()
    places = t_pose_m(body)[body.point_segments] + body.point_offsets_m
    at = dict(zip(body.point_names, places, strict=True))
    mirrored = [(_other(one), _other(other)) for one, other in PAIRS]
    pairs = {(min(pair), max(pair)) for pair in (*PAIRS, *mirrored)}
    return {pair: float(np.linalg.norm(at[pair[0]] - at[pair[1]])) for pair in sorted(pairs)}


def _other(name: str) -> str:
    return name.replace("left_", "right_") if name.startswith("left_") else name.replace("right_", "left_")
