"""A person who walks, in the names of any layout: where the points of the body are, and in an image."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from simrecon.body import names as body_names
from simrecon.body.skeleton import t_pose_m, template

STATURE_M = 1.75
ARMS = ("shoulder", "elbow", "wrist", "pinky", "index", "thumb")
LEGS = ("hip", "knee", "ankle", "heel", "toe", "mtp")


@cache
def _rest() -> dict[str, np.ndarray]:
    """Places in a T-pose that faces +x, z up from the sole."""
    body = template()
    places = t_pose_m(body)[body.point_segments] + body.point_offsets_m
    at = dict(zip(body.point_names, STATURE_M * places, strict=True))
    sole = at["left_heel"][2]
    return {name: place - [0.0, 0.0, sole] for name, place in at.items()}


def _turn(axis: str, angle: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) about x or y."""
    cos, sin, one, zero = np.cos(angle), np.sin(angle), np.ones_like(angle), np.zeros_like(angle)
    rows = {
        "x": [[one, zero, zero], [zero, cos, -sin], [zero, sin, cos]],
        "y": [[cos, zero, sin], [zero, one, zero], [-sin, zero, cos]],
    }[axis]
    return np.moveaxis(np.array(rows), -1, 0)


def walking(
    frames: int = 30, seed: int = 0, speed_mps: float = 0.0, fps: float = 30.0
) -> dict[str, np.ndarray]:
    """Points of the body (T, 3) by name, z up: a person of 1.75 m who faces +x, arms hanging."""
    phase = 2 * np.pi * np.arange(frames) / fps + seed
    at = {name: np.tile(place, (frames, 1)) for name, place in _rest().items()}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        swing = 0.4 * sign * np.sin(phase)
        _about(at, side, LEGS, "hip", _turn("y", -swing))
        _about(at, side, LEGS[1:], "knee", _turn("y", 0.5 + 0.3 * np.sin(phase)))
        _about(at, side, ARMS, "shoulder", _turn("x", np.full(frames, -sign * 1.35)))
        _about(at, side, ARMS, "shoulder", _turn("y", swing))
        _about(at, side, ARMS[1:], "elbow", _turn("y", np.full(frames, -0.6)))
    ahead = speed_mps * np.arange(frames)[:, None] / fps * [1.0, 0.0, 0.0]
    return {name: places + ahead for name, places in at.items()}


def _about(at: dict[str, np.ndarray], side: str, parts: Sequence[str], joint: str, turns: np.ndarray) -> None:
    centre = at[f"{side}_{joint}"]
    for part in parts:
        name = f"{side}_{part}"
        at[name] = centre + (turns @ (at[name] - centre)[..., None])[..., 0]


def named(at: dict[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
    """The points in the order of names (T, J, n); those without a place lie at the crown."""
    index = body_names.resolve(name if name else "nose" for name in names)
    points = [point["name"] for point in body_names.points()]
    which = [
        points[k] if name and k != body_names.IGNORED else "head_top"
        for name, k in zip(names, index, strict=True)
    ]
    return np.stack([at[name] for name in which], axis=1)


def seen(
    places: np.ndarray, yaw_rad: float = 0.6, px_per_m: float = 180.0, at_px: tuple[float, float] = (320, 400)
) -> np.ndarray:
    """Places (…, 3), z up, in the image of a camera far away: x right, y down, pixels (…, 2)."""
    x = places[..., 1] * np.cos(yaw_rad) + places[..., 0] * np.sin(yaw_rad)
    return np.stack((at_px[0] + px_per_m * x, at_px[1] - px_per_m * places[..., 2]), axis=-1)


def landmarks(names: Sequence[str], frames: int = 30, seed: int = 0) -> np.ndarray:
    """Landmarks (T, J, 2) in an image of 640 x 480."""
    return seen(named(walking(frames, seed), names), yaw_rad=0.6 + 0.2 * seed)
