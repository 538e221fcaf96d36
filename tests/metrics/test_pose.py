from __future__ import annotations

import numpy as np
import pytest

from simrecon.geometry import rotations
from simrecon.metrics import pose, smoothness
from simrecon.types import Array

FPS = 30.0


@pytest.fixture
def walk(rng: np.random.Generator) -> Array:
    """(T, J, 3) a body that moves away, 130 frames: a whole piece and a shorter one."""
    drift = np.arange(130)[:, None, None] * np.array([0.03, 0.0, 0.0])
    return rng.normal(size=(1, 12, 3)) + 0.05 * rng.normal(size=(130, 12, 3)) + drift


def turned(joints: Array, scale: float) -> Array:
    return scale * joints @ rotations.matrix(rotations.exp([0.3, -0.2, 1.0])).T + [4.0, -1.0, 0.3]


def test_world_alignment_undoes_one_similarity_of_the_clip(walk: Array) -> None:
    moved = turned(walk, 1.3)
    for score in (pose.w_mpjpe, pose.wa_mpjpe):
        assert score(moved, walk) == pytest.approx(0, abs=1e-9)
        assert score(turned(walk, 1.0), walk, with_scale=False) == pytest.approx(0, abs=1e-9)
        assert score(moved, walk, with_scale=False) > 0.1


def test_world_alignment_on_the_first_frames_sees_drift_that_is_counted_by_piece(walk: Array) -> None:
    drift = np.arange(130)[:, None, None] * np.array([0.0, 0.01, 0.0])
    first = pose.w_mpjpe(walk + drift, walk, with_scale=False)
    # the second piece starts anew at frame 100, so its mean error is that of 30 frames
    steps = np.concatenate((np.arange(100), np.arange(30))) - 0.5
    assert first == pytest.approx(0.01 * steps[1:].sum() / 130, rel=0.15)
    assert pose.wa_mpjpe(walk + drift, walk, with_scale=False) < 0.5 * first
    assert pose.w_mpjpe(walk + drift, walk, with_scale=False, frames=10) < 0.2 * first


def test_root_translation_error_is_a_share_of_the_way() -> None:
    way = np.zeros((11, 3))
    way[:, 0] = np.arange(11)
    assert pose.root_translation_error_pct(way[:, [1, 0, 2]] + 5.0, way) == pytest.approx(0, abs=1e-9)
    assert pose.root_translation_error_pct(1.1 * way, way) == pytest.approx(
        10 * 0.1 * 30 / 11 / 10 * 10, rel=1e-6
    )
    assert np.isnan(pose.root_translation_error_pct(way, 0 * way))


def test_pck_is_the_share_below_the_threshold() -> None:
    truth = np.zeros((1, 4, 3))
    joints = truth.copy()
    joints[0, :, 0] = [0.1, 0.149, 0.151, np.nan]
    assert pose.pck_pct(joints, truth) == pytest.approx(200 / 3)
    assert pose.pck_pct(joints[..., :2] * 100, truth[..., :2], 11.0) == pytest.approx(100 / 3)


def test_unknown_joints_are_left_out(walk: Array) -> None:
    moved = walk + np.array([0.0, 0.0, 0.1])
    moved[5, 3], moved[9] = np.nan, np.nan
    assert pose.mpjpe_g(moved, walk) == pytest.approx(0.1)
    assert smoothness.velocity(moved, walk, 1 / FPS) == pytest.approx(0, abs=1e-9)
    assert np.isnan(pose.mpjpe_g(np.full_like(walk, np.nan), walk))


def test_errors_do_not_change_when_both_move_together(walk: Array, rng: np.random.Generator) -> None:
    moved = walk + 0.02 * rng.normal(size=walk.shape)
    for score in (pose.mpjpe_g, pose.wa_mpjpe, smoothness.e_smooth):
        assert score(turned(moved, 1.0), turned(walk, 1.0)) == pytest.approx(float(score(moved, walk)))
    assert smoothness.jitter(turned(moved, 1.0), 1 / FPS) == pytest.approx(smoothness.jitter(moved, 1 / FPS))


def test_velocity_does_not_depend_on_the_rate_and_e_smooth_does() -> None:
    """A motion at 2 m/s against a reference at 1 m/s in the same direction."""
    for rate in (25.0, 50.0):
        way = np.arange(40)[:, None, None] / rate * np.array([1.0, 0, 0]) * np.ones((1, 3, 1))
        assert smoothness.velocity(2 * way, way, 1 / rate) == pytest.approx(1.0)
        assert smoothness.e_smooth(2 * way, way) == pytest.approx(1.0 / rate)
        assert smoothness.e_foot_vxy(2 * way, way) == pytest.approx(1.0 / rate)


def test_feet_of_xie() -> None:
    truth = np.zeros((5, 2, 3))
    feet = truth + np.array([0.3, 0.0, 0.02])
    feet[:, 1, 2] = -0.04
    assert smoothness.e_foot_z(feet, truth) == pytest.approx(0.03)
    feet[:, :, 2] += np.arange(5)[:, None]  # vertical steps don't count
    assert smoothness.e_foot_vxy(feet, truth) == pytest.approx(0.0)


def test_jitter_of_a_cubic() -> None:
    times = np.arange(20) / FPS
    path = np.zeros((20, 2, 3))
    path[..., 1] = times[:, None] ** 3
    assert smoothness.jitter(path, 1 / FPS) == pytest.approx(6.0)
    assert smoothness.jitter(path[:10] * 0 + times[:10, None, None] ** 2, 1 / FPS) == pytest.approx(
        0, abs=1e-6
    )


def test_first_frame_aligned_takes_out_heading_and_place_but_no_drift() -> None:
    rng = np.random.default_rng(5)
    truth = rng.normal(size=(4, 12, 3))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = truth @ turn.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(pose.first_frame_aligned(moved, truth), truth, atol=1e-12)
    moved[3] += 0.1 * turn[:, 0]  # (1, 0, 0) in the truth's axes
    off = pose.first_frame_aligned(moved, truth) - truth
    np.testing.assert_allclose(off[3], np.tile([0.1, 0.0, 0.0], (12, 1)), atol=1e-12)
    moved[0, 0] = np.nan
    assert np.isnan(pose.first_frame_aligned(moved, truth)).all()
