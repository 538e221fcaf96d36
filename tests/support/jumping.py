"""A person who stands on something high, jumps down and stands below, as a camera of known lens sees it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import body as bodies
from simrecon import prior
from simrecon.kinematics import forward
from simrecon.kinematics.layout import SEGMENTS
from simrecon.types import Camera, Evidence
from tests.kinematics import conftest as makers

HEIGHT_M, RATE_HZ, GRAVITY_MPS2, RISE_M, WAY_M = 1.75, 30.0, 9.81, 0.15, 1.0


def way(high_m: float, on_top_s: float, below_s: float) -> np.ndarray:
    """(T, 3) m of the feet: at rest, in free fall, at rest."""
    up = np.sqrt(2 * GRAVITY_MPS2 * RISE_M)
    falls_s = (up + np.sqrt(up**2 + 2 * GRAVITY_MPS2 * high_m)) / GRAVITY_MPS2
    times = np.arange(0, on_top_s + falls_s + below_s, 1 / RATE_HZ) - on_top_s
    air = np.clip(times, 0, falls_s)
    height = high_m + up * air - GRAVITY_MPS2 / 2 * air**2
    return np.stack((WAY_M * air / falls_s, np.zeros_like(air), height), axis=1)


def seen(
    high_m: float, on_top_s: float, below_s: float, seed: int = 0, height_m: float = HEIGHT_M
) -> Evidence:
    """Landmarks with noise, and a 3D estimate around the hips, of a person whose size nobody knows."""
    skeleton = bodies.scaled({}, height_m)
    root = way(high_m, on_top_s, below_s)
    times = np.arange(len(root)) / RATE_HZ
    rotvecs = np.zeros((SEGMENTS, len(root), 3))
    rotvecs[1:] = prior.gaussian(skeleton).mean_rad[:, None]
    for side in ("left", "right"):
        rotvecs[skeleton.names.index(f"{side}_shoulder"), :, 1] += 0.5 * np.sin(4 * times)
    level = np.broadcast_to(np.eye(3), (len(root), 3, 3))
    pose = forward.forward(skeleton, root, level, rotvecs, 1.0)
    points = forward.points(pose, skeleton.point_segments, skeleton.point_offsets_m)
    toes = points[[skeleton.point_names.index(f"{side}_toe") for side in ("left", "right")], 0, 2]
    shift = np.array([0.0, 0.0, high_m - float(toes.min()) + 0.02])
    walk = makers.Walk(skeleton, times, root + shift, rotvecs, points + shift)
    camera = makers.looking_at(np.array([1.5, -5.0, 1.4]), np.array([0.5, 0.0, 1.0]))
    evidence = makers.in_camera(makers.seen(walk, camera, 2.0, 0.03, seed), True)
    return replace(evidence, camera=Camera(camera.lens))
