from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon.geometry import camera as cameras
from tools.bench import flips


@pytest.mark.slow
def test_the_skin_is_painted_where_the_joints_are(shared_data: Path) -> None:
    recording = shared_data / "mocap" / "mass_bvh" / "backflip.bvh"
    seen = shared_data / "evidence" / "pose2sim_beam_cam01.npz"
    made = flips.filmed(recording, seen, place_m=(-0.9, 0.0), heading_deg=60.0)
    short = replace(made, true_px=made.true_px[:1])
    (image,) = flips.frames(short, itertools.repeat(np.full((1920, 1080, 3), 128, np.uint8)))
    painted = np.abs(image.astype(int) - 128).max(axis=2) > 0
    joints = made.true_px[0].round().astype(int)
    assert painted[joints[:, 1], joints[:, 0]].mean() > 0.9
    assert 0.5 < np.ptp(np.argwhere(painted)[:, 0]) / made.height_px[0] < 1.2
    assert cameras.is_still(made.camera)


def test_of_a_photograph_the_person_is_taken_out() -> None:
    wall = np.full((60, 80, 3), 200, np.uint8)
    images, outlines = [], []
    for x in (20, 50):
        image = wall.copy()
        image[20:40, x - 5 : x + 5] = 0
        images.append(image)
        outlines.append(np.array([[x - 4, 20], [x + 4, 20], [x + 4, 39], [x - 4, 39.0], [np.nan, np.nan]]))
    np.testing.assert_array_equal(flips.plate(iter(images), iter(outlines), grow=0.25), wall)
