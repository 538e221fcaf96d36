"""Head and feet, which no bone of the skeleton sizes: from what was measured of them, if that is likely."""

from __future__ import annotations

import numpy as np

from simrecon.types import Array, Skeleton

FOOT_SHARE = (0.065, 0.17)
"""Heel to toe as a share of stature: outside of it an estimate of the foot is not believed."""
DROP_SHARES = (0.018, 0.0545)
"""From the ankle down to the ball of a standing foot, as shares of stature; the sole is 0.039 below."""
HEAD_SPREAD = 0.25
"""A head larger or smaller by more, for the body's size, is not believed: many rigs end it anywhere."""
FOOT_SPREAD = 0.4
"""A foot that is larger or smaller by more, for the body's size, is not believed."""


def head_ratio(
    unit: Skeleton, lengths_m: dict[str, float], ratios: dict[str, float], overall: float
) -> float:
    """Size of the head over that of the template; that of the body where only the neck was measured."""
    if "skull" in lengths_m:
        ratio = lengths_m["skull"] / float(
            np.linalg.norm(unit.point_offsets_m[unit.point_names.index("head_top")])
        )
        return ratio if abs(ratio / overall - 1) < HEAD_SPREAD else overall
    return ratios.get("head", overall) if "head" in lengths_m else overall


def feet(unit: Skeleton, lengths_m: dict[str, float], overall: float) -> dict[str, Array]:
    """Heel, toe and joint of the big toe by where that joint is over the sole; none where the foot is odd.

    Rigs of animation programs have the joint on the sole, bodies a little over it: the sole is under the
    joint, and as far under the ankle as the body's size tells, whichever is lower.
    """
    low, high = (overall * share for share in DROP_SHARES)
    drops = [lengths_m[key] for key in ("mtp_drop", "mtp_rest_drop") if low < lengths_m.get(key, 0.0) < high]
    if not drops or "ankle_mtp" not in lengths_m:
        return {}
    at = {
        name: unit.point_offsets_m[unit.point_names.index(f"left_{name}")] for name in ("heel", "toe", "mtp")
    }
    drop, reach = drops[0], lengths_m["ankle_mtp"]
    forward = float(np.sqrt(max(reach**2 - drop**2, 0.0)))
    ratio = forward / float(at["mtp"][0])
    if abs(ratio / overall - 1) > FOOT_SPREAD:
        return {}
    sole = max(drop, -overall * float(at["heel"][2]))
    soles = {name: np.array([ratio * at[name][0], 0.0, -sole]) for name in ("heel", "toe")}
    return {**soles, "mtp": np.array([forward, 0.0, -drop])}


def foot_point(which: str, lengths_m: dict[str, float], scale: float, default: Array) -> Array:
    """Heel or toe from the triangle ankle-heel-toe, its base level in the T-pose (Heron's formula)."""
    try:
        a, b, c = (lengths_m[key] for key in ("ankle_heel", "ankle_toe", "heel_toe"))
    except KeyError:
        return default
    half = 0.5 * (a + b + c)
    if not FOOT_SHARE[0] < c / scale < FOOT_SHARE[1]:
        return default
    area_squared = half * (half - a) * (half - b) * (half - c)
    if area_squared <= 0:
        return default
    drop = 2 * np.sqrt(area_squared) / c
    forward = -np.sqrt(a**2 - drop**2) if which == "heel" else np.sqrt(b**2 - drop**2)
    return np.array([forward, 0.0, -drop])
