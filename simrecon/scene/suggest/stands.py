"""Beams and steps under feet that stand over the floor."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.contact import rules
from simrecon.scene import geometry, schema
from simrecon.scene.suggest.motion import Motion, spans, speed_mps
from simrecon.scene.suggest.suggestion import Suggestion
from simrecon.types import Array, Scene

# What counts as a foot that stands on something over the floor.
FOOT_LEAST_S, FOOT_LEAST_M, FOOT_TOTAL_S = 0.12, 0.04, 0.3
SAME_HEIGHT_M = 0.06
BEAM_ASPECT, BEAM_WIDTH_MAX_M, MARGIN_M = 4.0, 0.25, 0.1
BEAM_COSINE = 0.7

_Stance = tuple[float, int, int, int]
"""A foot that stands still: height over what is known to be under it (m), side, first and last frame."""


def under_feet(motion: Motion, scene: Scene, least_m: float = FOOT_LEAST_M) -> list[Suggestion]:
    """Beams and steps: where feet stand still over what is known to be under them, by height.

    Args:
        motion: of the person.
        scene: floor and items that are known already.
        least_m: height from which a foot needs a support.
    """
    stances = _bearing(_stances(motion, scene), motion)
    suggestions = []
    while stances:
        height = max(stances)[0]
        group = [stance for stance in stances if height - stance[0] < SAME_HEIGHT_M]
        stances = [stance for stance in stances if stance not in group]
        seconds = sum(float(motion.times_s[b] - motion.times_s[a]) for _, _, a, b in group)
        if np.median([stance[0] for stance in group]) > least_m and seconds >= FOOT_TOTAL_S:
            suggestions.append(_stand(motion, scene, group, seconds))
    return suggestions


def stance_heights(motion: Motion) -> list[float]:
    """Heights (m) at which feet that bear weight stand, one for each time that one stands long enough."""
    return [stance[0] for stance in _bearing(_stances(motion, Scene()), motion)]


def _stances(motion: Motion, scene: Scene) -> list[_Stance]:
    """Feet that stand still, over what is known to be under them."""
    stances: list[_Stance] = []
    for side in range(2):
        middle = motion.soles_m[side].mean(axis=1)  # (T, 3)
        support = geometry.support_height(scene, middle[:, :2])
        over = motion.soles_m[side][..., 2].min(axis=1) - support
        tilt = np.ptp(motion.soles_m[side][..., 2], axis=1)
        stood = rules.stands(speed_mps(middle, motion.times_s), tilt)
        for first, last in spans(stood, motion.times_s, FOOT_LEAST_S):
            stances.append((float(np.median(over[first : last + 1])), side, first, last))
    return stances


def _bearing(stances: list[_Stance], motion: Motion) -> list[_Stance]:
    """The stances of feet that bear weight: not of one held up while the other is far lower."""
    lowest = motion.soles_m[..., 2].min(axis=(0, 2))  # (T,)
    kept = []
    for stance in stances:
        _, side, first, last = stance
        own = motion.soles_m[side, first : last + 1, :, 2].min(axis=1)
        if np.median(own - lowest[first : last + 1]) < SAME_HEIGHT_M / 2:
            kept.append(stance)
    return kept


def _lengthwise(prints: Array, along: Array) -> float:
    """How much feet (N, 4, 2) point along a direction, 0 to 1: who stands on a beam has them in a row."""
    ahead = prints[:, 2:].mean(axis=1) - prints[:, :2].mean(axis=1)  # (N, 2) from the heels to the toes
    ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    return float(np.abs(ahead @ along).mean())


def _stand(motion: Motion, scene: Scene, group: list[_Stance], seconds: float) -> Suggestion:
    prints = np.concatenate(
        [np.median(motion.soles_m[side, a : b + 1], axis=0) for _, side, a, b in group]
    )  # (4n, 3)
    middles = prints.reshape(-1, 4, 3).mean(axis=1)[:, :2]
    centre = middles.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((prints[:, :2] - prints[:, :2].mean(axis=0)).T))
    along = axes[:, 1] * (1.0 if axes[np.argmax(np.abs(axes[:, 1])), 1] > 0 else -1.0)
    across = np.array([-along[1], along[0]])
    reach, wide = (prints[:, :2] - centre) @ along, (middles - centre) @ across
    floor = float(geometry.ground_height(scene.ground, centre))
    # the lowest corners: no foot stands in what bears it
    height = max(float(np.median(prints[:, 2].reshape(-1, 4).min(axis=1))) - floor, 0.01)
    length = float(np.ptp(reach)) + 2 * MARGIN_M
    drift = float(np.ptp(wide))
    beam = length / max(drift, 0.05) > BEAM_ASPECT and drift < BEAM_WIDTH_MAX_M
    beam = beam and _lengthwise(prints.reshape(-1, 4, 3)[..., :2], along) > BEAM_COSINE
    width = max(drift, 0.1) if beam else float(np.ptp((prints[:, :2] - centre) @ across)) + 2 * MARGIN_M
    place = centre + along * (reach.max() + reach.min()) / 2 + across * (wide.max() + wide.min()) / 2
    table: dict[str, Any] = {
        "name": "beam" if beam else "step",
        "kind": "beam",
        "position_m": [round(float(place[0]), 3), round(float(place[1]), 3), round(floor, 3)],
        "yaw_rad": round(float(np.arctan2(along[1], along[0])), 3),
        "length_m": round(length, 3),
        "width_m": round(width, 3),
        "height_m": round(height, 3),
    }
    if not beam:
        size = [table.pop(key) for key in ("length_m", "width_m", "height_m")]
        table |= {"kind": "box", "size_m": size}
    low, high = (1e3 * f(stance[0] for stance in group) for f in (min, max))
    why = (
        f"{len(group)} time{'s' if len(group) > 1 else ''}, {seconds:.1f} s in all, a foot stands "
        f"{low:.0f} to {high:.0f} mm over what is known to be under it"
    )
    runs = tuple(sorted((a, b) for _, _, a, b in group))
    return Suggestion(schema.item(table, "suggestion"), why, runs)
