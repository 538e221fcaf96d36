"""Capsules around the bones of a motion that is known by its joints alone.

Motions that are nothing but joints (an estimate, a reference, another method) get capsules around their
bones, and their feet as they rest in the reference, so that all stand in one table; a simulated body has its
own primitives. Axes: T frames, K joints, C parts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from simrecon import resources
from simrecon import scene as scenes
from simrecon.contact import rules
from simrecon.metrics import anthropometry
from simrecon.metrics.feet import SKATE_SPEED_MPS
from simrecon.metrics.smoothness import steps
from simrecon.metrics.truth import FOOT_POINTS
from simrecon.types import Array, Flags, Scene

_SAMPLES = np.linspace(0.0, 1.0, 5)  # along a bone; the ends decide over a plane


@dataclass(frozen=True, eq=False)
class Bones:
    """Capsules around bones, C parts.

    Attributes:
        names: of the parts; those of FOOT_POINTS are points.
        starts, ends: joints whose middle is an end, by part.
        radii_m: (C,); for foot points the height at which they rest in the reference.
        along: (C, 2) where on the way from start to end the capsule begins and ends.
        behind_m: (C,) how far its axis lies behind the bone, as the trunk faces.
    """

    names: tuple[str, ...]
    starts: tuple[tuple[str, ...], ...]
    ends: tuple[tuple[str, ...], ...]
    radii_m: Array
    along: Array
    behind_m: Array


@cache
def _radii() -> dict[str, float]:
    primitives = resources.toml("models", "body", "primitives.toml")["primitive"]
    return {entry["name"]: float(entry["radius"]) for entry in primitives if "radius" in entry}


def capsule_primitives() -> tuple[str, ...]:
    """Names of the primitives whose radii the capsules have."""
    return tuple(dict.fromkeys(entry["primitive"] for entry in anthropometry.entries("capsule")))


def bones(
    names: Sequence[str], truth_m: Array, scene: Scene, radii_m: Mapping[str, float] | None = None
) -> Bones:
    """Capsules that every motion of a clip gets, set by its reference.

    Args:
        names: K names of the reference, with the body's 12 joints.
        truth_m: (T, K, 3) the reference.
        scene: what the person may touch.
        radii_m: of the person's primitives; None: those of an average person of the reference's stature.

    Returns:
        The capsules of `models/body/centre_of_mass.toml`, and the foot points that the reference has; those
        rest at the 5th percentile of their distance to the scene.
    """
    stature = anthropometry.stature_m(names, truth_m)
    if radii_m is None:
        radii_m = {name: stature * radius for name, radius in _radii().items()}
    capsules = anthropometry.entries("capsule")
    feet = [point for point in FOOT_POINTS if point in names]
    rest = [rules.rest_height_m(over(scene, truth_m[:, list(names).index(point)])) for point in feet]
    radii = [radii_m[entry["primitive"]] for entry in capsules]
    return Bones(
        (*(entry["name"] for entry in capsules), *feet),
        (*(tuple(entry["from"]) for entry in capsules), *((point,) for point in feet)),
        (*(tuple(entry["to"]) for entry in capsules), *((point,) for point in feet)),
        np.array(radii + rest),
        np.array([entry.get("along", [0.0, 1.0]) for entry in capsules] + [[0.0, 1.0]] * len(feet)),
        np.array([stature * entry.get("behind", 0.0) for entry in capsules] + [0.0] * len(feet)),
    )


def bone_clearance(parts: Bones, names: Sequence[str], joints_m: Array, scene: Scene) -> Array:
    """Distance of each capsule to the nearest surface of the scene, negative inside; (T, K, 3) → (T, C)."""
    at = {name: joints_m[:, k] for k, name in enumerate(names)}
    start, end = (  # (T, C, 3)
        np.stack([np.mean([at[joint] for joint in part], axis=0) for part in ends], axis=1)
        for ends in (parts.starts, parts.ends)
    )
    way = parts.along[:, :1] + _SAMPLES * np.diff(parts.along, axis=1)  # (C, 5)
    points = start[..., None, :] + way[..., None] * (end - start)[..., None, :]  # (T, C, 5, 3)
    points -= parts.behind_m[:, None, None] * _ahead(at)[..., None, None, :]
    return np.asarray(over(scene, points).min(-1) - parts.radii_m)


def _ahead(at: Mapping[str, Array]) -> Array:
    """Unit vectors (T, 3) in which the trunk faces."""
    left, right = (at[f"{side}_hip"] for side in ("left", "right"))
    up = at["left_shoulder"] + at["right_shoulder"] - left - right
    ahead = np.cross(left - right, up)
    return np.asarray(ahead / np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-9))


def touching(
    parts: Bones, names: Sequence[str], joints_m: Array, clearance: Array, interval_s: float
) -> Flags:
    """Which parts touch their support, (T, C): those within 3 cm of it.

    Heels and toes, which swing past as near as that, must also be slower than 0.5 m/s, by the frame they
    arrive at; the first frame takes the speed of the second.

    Args:
        parts: C capsules.
        names: K names.
        joints_m: (T, K, 3).
        clearance: (T, C) from `bone_clearance`.
        interval_s: between frames.
    """
    feet = [k for k, part in enumerate(parts.names) if part in FOOT_POINTS]
    points = joints_m[:, [list(names).index(parts.names[k]) for k in feet]]  # (T, F, 3)
    speed = steps(points) / interval_s  # (T-1, F)
    near = rules.touches(clearance)
    near[:, feet] &= np.concatenate((speed[:1], speed)) < SKATE_SPEED_MPS
    return np.asarray(near)


def over(scene: Scene, points_m: Array) -> Array:
    """Distance to the nearest surface of the scene, (..., 3) → (...)."""
    return np.asarray(scenes.distances(scene, points_m)[0].min(axis=0))
