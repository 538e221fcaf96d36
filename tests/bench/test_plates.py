from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence
from simrecon.bench import places, plates
from simrecon.metrics import anthropometry, dynamics, filters
from simrecon.metrics.truth import read_truth
from simrecon.types import Evidence


def test_plates_go_to_the_nearer_foot() -> None:
    """Two plates, the first under the right foot; a third that nobody touches."""
    force, centre, ankles = np.zeros((4, 3, 3)), np.zeros((4, 3, 3)), np.zeros((4, 2, 3))
    ankles[:, 0, 1], ankles[:, 1, 1] = 0.1, -0.1
    force[:, 0, 2], force[1:3, 1, 2] = 300.0, 200.0
    centre[:, 0], centre[:, 1] = [0.05, -0.12, 0], [0.0, 0.12, 0]
    found, pressure = plates.by_foot(force, centre, ankles)
    np.testing.assert_allclose(found[:, 1, 2], 300)
    np.testing.assert_allclose(found[:, 0, 2], [0, 200, 200, 0])
    np.testing.assert_allclose(pressure[1], [[0.0, 0.12, 0], [0.05, -0.12, 0]])
    assert np.isnan(pressure[0, 0]).all()


def test_frames_beside_the_plates_are_not_known() -> None:
    feet, force = np.zeros((20, 2, 2, 3)), np.zeros((20, 2, 3))
    force[:, :, 2] = 300.0
    force[5:8, 0, 2] = 0.0  # the left foot stands, but not on a plate
    force[12:, 1, 2] = 0.0
    feet[12:, 1, :, 2] = 0.2  # the right one is lifted
    known = plates.known_frames(force, feet, 0.01)
    np.testing.assert_array_equal(np.flatnonzero(~known), [5, 6, 7])
    assert plates.known_frames(force, feet, 0.01, feet_on_plates=True).all()
    feet[:4, ..., 2] = 0.3
    late = plates.known_frames(force, feet, 0.01, below_m=0.25, feet_on_plates=True)
    np.testing.assert_array_equal(np.flatnonzero(~late), np.arange(4))


def test_a_real_walk_carries_its_weight(shared_data: Path, tmp_path: Path) -> None:
    """Joint centres, mass and plates fit together: what the joints ask for is what the plates measured."""
    folder = shared_data / "grf" / "opencap_subject4"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    trial, static, forces = (folder / name for name in ("walking1.trc", "static1.trc", "walking1_grf.mot"))
    given, path = plates.make(tmp_path, trial, static, forces, mass_kg=60.1, cutoff_hz=6.0, span_s=(0.1, 1.2))
    truth = read_truth(path)
    assert truth.plates is not None
    assert truth.plates.cutoff_hz == 6.0
    assert evidence.read(given).times_s[0] == pytest.approx(0.1)
    com = anthropometry.centre_of_mass(truth.joint_names, truth.joints_m)
    implied = dynamics.implied_grf(filters.low_pass(com, 0.01, 6.0), 60.1, 0.01)[:, 2]
    measured = filters.low_pass(truth.plates.force_N.sum(1), 0.01, 6.0)[1:-1, 2]
    known = truth.plates.known[1:-1]
    assert known.mean() > 0.8
    assert dynamics.correlation(implied[known], measured[known]) > 0.95
    assert 100 * np.abs(implied - measured)[known].mean() / (60.1 * 9.81) < 8


def test_platform_is_under_the_first_feet() -> None:
    names = ("left_heel", "right_heel", "left_toe", "right_toe")
    joints = np.zeros((5, 4, 3))
    joints[:, :2] = [[1.0, 0.1, 0.32], [1.0, -0.1, 0.32]]
    joints[:, 2:] = joints[:, :2] + np.array([0.0, 0.2, 0.0])
    joints[0] = np.nan
    given = Evidence(np.arange(5) / 30, (), np.empty((5, 0, 2)), np.empty((5, 0)), names, joints, "world")
    (box,) = places.platform(given, 0.3).items
    assert box.parameters["size_m"] == pytest.approx((0.2 + 0.15 + 0.08, 0.8, 0.3))
    assert box.position_m == pytest.approx((1.0, 0.065, 0.0), abs=1e-3)
    assert box.yaw_rad == pytest.approx(np.pi / 2, abs=1e-3)
