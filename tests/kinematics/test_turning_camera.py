"""A walk before a camera whose path is found from its background, beside one that stands still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import kinematics
from simrecon.evidence.video import carried
from simrecon.geometry import camera as cameras
from simrecon.kinematics import world
from simrecon.plan import Kinematics
from simrecon.types import Array, Camera, Scene
from tests.kinematics.conftest import Makers, Walk
from tests.support import textured

T = 40
WORSE_MAX = 1.2
"""Of the error before a still camera."""


def off_m(make: Makers, walk: Walk, camera: Camera, known: Camera, weights: Kinematics) -> float:
    """Mean error of a fit whose world is where the real camera stands in the first frame (MPJPE-G).

    Args:
        make: of the tests.
        walk: the truth.
        camera: the real one.
        known: what is known of it: a lens, and a path in a world of its own.
        weights: of the fit.
    """
    seen = make.in_camera(make.seen(walk, camera, noise_px=2.0, noise_m=0.03), True)
    seen = replace(seen, camera=known, ground_known=False, height_m=1.75)
    fit = world.placed(kinematics.fit(seen, Scene(), weights), camera)
    points: Array = kinematics.configurations(fit.body, fit.qpos)[1]
    return float(np.linalg.norm(points - np.swapaxes(walk.points_m, 0, 1), axis=-1).mean())


def test_a_path_found_from_the_background_costs_little(make: Makers, weights: Kinematics) -> None:
    walk = make.walking(T)
    still = make.looking_at(np.array([5.0, -1.5, 1.4]), np.array([1.0, 0.5, 0.9]))
    still = replace(still, lens=textured.LENS)
    turns, picture = textured.swaying(T), textured.wall()
    path = np.array(cameras.extrinsics(cameras.lasting(still, T)))
    path[:, :3] = turns @ path[:, :3]
    found = carried.follow(
        Camera(textured.LENS), textured.views([textured.turned(picture, r) for r in turns])
    )
    assert found.camera.path is not None
    before = off_m(make, walk, cameras.lasting(still, T), Camera(textured.LENS), weights)
    after = off_m(make, walk, cameras.with_path(still, path), found.camera, weights)
    assert after < WORSE_MAX * before, (before, after)
    blind = off_m(make, walk, cameras.with_path(still, path), Camera(textured.LENS), weights)
    assert blind > 1.5 * before  # taken for still
