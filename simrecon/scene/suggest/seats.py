"""Seats and beds under a pelvis at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.contact import rules
from simrecon.scene import geometry, schema
from simrecon.scene.suggest.motion import Motion, spans, speed_mps
from simrecon.scene.suggest.suggestion import Suggestion
from simrecon.types import Array, Scene

REST_LEAST_S, REST_TOTAL_S = 0.3, 0.7
LYING_RAD = np.deg2rad(55)
SAME_PLACE_M = 0.5
SEAT_BEHIND_M, SEAT_BEFORE_M, SEAT_LEAST_DEPTH_M, SEAT_WIDTH_M = 0.25, 0.15, 0.25, 0.9
SEAT_THICK_M = 0.12
# Of the heights at rest: flesh gives way, primitives don't, and who hovers over a seat squats.
SEAT_PERCENTILE = 75.0


def under_pelvis(motion: Motion, scene: Scene, stature_m: float) -> list[Suggestion]:
    """Seats and beds: where a pelvis rests, too low to stand and too high to lie on the floor.

    Args:
        motion: of the person.
        scene: floor and items that are known already.
        stature_m: of the person.
    """
    support = geometry.support_height(scene, motion.pelvis_m[:, :2])
    over = motion.under_m - support
    rests = rules.seated(over, speed_mps(motion.pelvis_m, motion.times_s), stature_m)
    suggestions = []
    for group in _by_place(spans(rests, motion.times_s, REST_LEAST_S), motion):
        frames = np.concatenate([np.arange(first, last + 1) for first, last in group])
        if sum(motion.times_s[last] - motion.times_s[first] for first, last in group) >= REST_TOTAL_S:
            suggestions.append(_seat(motion, scene, group, frames))
    return suggestions


def _by_place(runs: list[tuple[int, int]], motion: Motion) -> list[list[tuple[int, int]]]:
    """Groups of runs of frames whose pelvis rests within `SAME_PLACE_M` of the group's first place."""
    groups: list[list[tuple[int, int]]] = []
    places: list[Array] = []
    for first, last in runs:
        here = np.median(motion.pelvis_m[first : last + 1], axis=0)
        near = [i for i, place in enumerate(places) if np.linalg.norm(here - place) < SAME_PLACE_M]
        if near:
            groups[near[0]].append((first, last))
        else:
            groups.append([(first, last)])
            places.append(here)
    return groups


def _seat(motion: Motion, scene: Scene, runs: list[tuple[int, int]], frames: NDArray[np.int64]) -> Suggestion:
    top = float(np.percentile(motion.under_m[frames], SEAT_PERCENTILE))
    place = np.median(motion.pelvis_m[frames], axis=0)
    facing = motion.facing[frames].mean(axis=0)
    facing /= max(float(np.linalg.norm(facing)), 1e-9)
    yaw = float(np.arctan2(facing[1], facing[0]))
    floor = float(geometry.ground_height(scene.ground, place[:2]))
    lying = bool(np.median(motion.tilt_rad[frames]) > LYING_RAD)
    half = 1.0
    name, kind, front = "bed", "box", 1.0
    if not lying:
        # the front edge lies under the thigh, and behind the heels
        soles = motion.soles_m[:, frames][..., :2] - place[:2]  # (2, F, 4, 2)
        heels = float(np.median((soles @ facing).min(axis=-1)))
        name, kind, front = (
            "seat",
            "chair",
            min(SEAT_BEFORE_M, max(heels - 0.03, SEAT_LEAST_DEPTH_M - SEAT_BEHIND_M)),
        )
        half = (front + SEAT_BEHIND_M) / 2
    middle = place[:2] + facing * (front - half)
    height = max(top - floor, 0.02)
    position = [round(float(middle[0]), 3), round(float(middle[1]), 3), round(floor, 3)]
    table: dict[str, Any] = {"name": name, "kind": kind, "position_m": position, "yaw_rad": round(yaw, 3)}
    if lying:
        table["size_m"] = [round(2 * half, 3), 1.0, round(height, 3)]
    else:  # open below, where heels and calves go
        table |= {
            "seat_height_m": round(height, 3),
            "seat_depth_m": round(2 * half, 3),
            "seat_width_m": SEAT_WIDTH_M,
            "seat_m": round(min(SEAT_THICK_M, height / 2), 3),
            "back": False,
        }
    seconds = sum(float(motion.times_s[b] - motion.times_s[a]) for a, b in runs)
    how = "lies" if lying else "rests"
    why = (
        f"the pelvis {how} {len(runs)} time{'s' if len(runs) > 1 else ''}, {seconds:.1f} s in all, "
        f"with its underside {height:.2f} m over the floor"
    )
    return Suggestion(schema.item(table, "suggestion"), why, tuple(runs))
