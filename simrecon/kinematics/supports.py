"""What a motion touches and rests on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon import scene as scenes
from simrecon.contact import rules
from simrecon.kinematics import forward, root
from simrecon.kinematics.contacts import ContactPoints
from simrecon.types import Array, Scene

# Supports are steps in height; a pelvis takes them smoothly.
SUPPORT_SMOOTH_S = 0.2
LEVEL_COSINE = 0.7


@dataclass(frozen=True, eq=False)
class Supports:
    """What a motion touches; S supports, the ground first and then all items, G contact points.

    Attributes:
        clearance_m: (S, G, T) signed distance, negative inside.
        touching: (S, G, T) how surely a point touches a support, 0 to 1.
        held: (G, T - 1) how surely a point rests on something from a frame to the next, 0 to 1.
        height_m: (T,) of what the person rests on, interpolated where that is nothing.
    """

    clearance_m: Array
    touching: Array
    held: Array
    height_m: Array


def supports(scene: Scene, touch: ContactPoints, pose: forward.Pose, interval_s: float) -> Supports:
    """Which points of a posed body touch what, and which of them rest there."""
    points = forward.points(pose, touch.segments, touch.offsets_m)  # (G, T, 3)
    apart, normals = scenes.distances(scene, points)
    clearance = apart - touch.radii_m[:, None]
    touching = rules.touching(clearance)
    speed = np.linalg.norm(np.diff(points, axis=1), axis=-1) / interval_s  # (G, T - 1)
    held = rules.held(speed, touching.max(axis=0))
    weight = np.where(normals[..., 2] > LEVEL_COSINE, touching, 0.0)  # (S, G, T)
    total = weight.sum(axis=(0, 1))
    above = np.sum(weight * (points[..., 2] - apart * normals[..., 2]), axis=(0, 1))
    height = above / np.maximum(total, 1e-9)
    filled = root.filled(height[:, None], total > 0.5)
    smooth = gaussian_filter1d(filled[:, 0], SUPPORT_SMOOTH_S / interval_s, mode="nearest")
    return Supports(clearance, touching, held, smooth)
