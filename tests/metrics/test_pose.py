from __future__ import annotations

import numpy as np
import pytest

from simrecon.geometry import rotations
from simrecon.metrics import pose
from simrecon.metrics.statistics import of_frames
from simrecon.types import Array


@pytest.fixture
def walk(rng: np.random.Generator) -> Array:
    """(T, J, 3) a body that moves away, 130 frames: a whole piece and a shorter one."""
    drift = np.arange(130)[:, None, None] * np.array([0.03, 0.0, 0.0])
    return rng.normal(size=(1, 12, 3)) + 0.05 * rng.normal(size=(130, 12, 3)) + drift


def turned(joints: Array, scale: float) -> Array:
    return scale * joints @ rotations.matrix(rotations.exp([0.3, -0.2, 1.0])).T + [4.0, -1.0, 0.3]


def mean(values: Array) -> float:
    return of_frames(values).value


def test_mpjpe_g_is_the_mean_distance(walk: Array) -> None:
    moved = walk.copy()
    moved[:, :6] += [0.03, 0.0, 0.04]
    assert mean(pose.distances(moved, walk)) == pytest.approx(0.025)
    assert mean(pose.distances(walk, walk)) == 0


def test_mpjpe_ignores_the_root_of_each_frame_and_align1_of_the_first(walk: Array) -> None:
    root = walk[:, :2].mean(1)
    drift = np.linspace(1, 2, 130)[:, None] * np.array([1.0, 0, 0])  # (T, 3) from 1 m to 2 m
    moved = walk + drift[:, None]
    assert mean(pose.mpjpe_errors(moved, walk, root + drift, root)) == pytest.approx(0, abs=1e-12)
    assert mean(pose.mpjpe_g_align1_errors(moved, walk, root + drift, root)) == pytest.approx(0.5)
    assert mean(pose.distances(moved, walk)) == pytest.approx(1.5)
    assert mean(pose.distances(root + drift, root)) == pytest.approx(1.5)


def test_mpjpe_pa_undoes_a_similarity_of_each_frame_and_skips_unknown_ones(walk: Array) -> None:
    scale = np.linspace(0.5, 2.0, 130)[:, None, None]
    moved = turned(scale * walk, 1.0)
    assert mean(pose.mpjpe_pa_errors(moved, walk)) == pytest.approx(0, abs=1e-9)
    assert mean(pose.mpjpe_pa_errors(walk * [1, 1, -1], walk)) > 0.05
    moved[7, 3] = np.nan
    errors = pose.mpjpe_pa_errors(moved, walk)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(errors).all(-1)), [7])
    assert mean(errors) == pytest.approx(0, abs=1e-9)


def test_world_alignment_undoes_one_similarity_of_the_clip(walk: Array) -> None:
    moved = turned(walk, 1.3)
    for first in (True, False):
        assert mean(pose.w_mpjpe_errors(moved, walk, first=first)) == pytest.approx(0, abs=1e-9)
        rigid = pose.w_mpjpe_errors(turned(walk, 1.0), walk, first=first, with_scale=False)
        assert mean(rigid) == pytest.approx(0, abs=1e-9)
        assert mean(pose.w_mpjpe_errors(moved, walk, first=first, with_scale=False)) > 0.1


def test_world_alignment_on_the_first_frames_sees_drift_that_is_counted_by_piece(walk: Array) -> None:
    drift = np.arange(130)[:, None, None] * np.array([0.0, 0.01, 0.0])
    first, whole = (
        mean(pose.w_mpjpe_errors(walk + drift, walk, first=first, with_scale=False))
        for first in (True, False)
    )
    # the second piece starts anew at frame 100, so its mean error is that of 30 frames
    steps = np.concatenate((np.arange(100), np.arange(30))) - 0.5
    assert first == pytest.approx(0.01 * steps[1:].sum() / 130, rel=0.15)
    assert whole < 0.5 * first


def test_rigid1_takes_out_heading_and_place_and_no_drift(walk: Array) -> None:
    assert mean(pose.mpjpe_g_rigid1_errors(turned(walk, 1.0), walk)) == pytest.approx(0, abs=1e-9)
    drift = np.arange(130)[:, None, None] * np.array([0.0, 0.01, 0.0])
    errors = pose.mpjpe_g_rigid1_errors(turned(walk + drift, 1.0), walk)
    np.testing.assert_allclose(errors[:, 0], 0.01 * np.arange(130), atol=1e-9)


def test_root_translation_error_is_a_share_of_the_way() -> None:
    way = np.zeros((11, 3))
    way[:, 0] = np.arange(11)
    assert pose.root_translation_error_pct(way[:, [1, 0, 2]] + 5.0, way) == pytest.approx(0, abs=1e-9)
    assert pose.root_translation_error_pct(1.1 * way, way) == pytest.approx(
        10 * 0.1 * 30 / 11 / 10 * 10, rel=1e-6
    )
    assert np.isnan(pose.root_translation_error_pct(way, 0 * way))


def test_pck_is_the_share_of_root_aligned_joints_below_the_threshold() -> None:
    truth = np.zeros((1, 4, 3))
    joints = truth.copy()
    joints[0, :, 0] = [0.1, 0.149, 0.151, np.nan]
    root, away = np.zeros((1, 3)), np.full((1, 3), 7.0)
    np.testing.assert_array_equal(pose.pck_hits(joints, truth, root, root), [[1, 1, 0, np.nan]])
    np.testing.assert_array_equal(pose.pck_hits(joints + 7.0, truth, away, root, 0.14), [[1, 0, 0, np.nan]])


def test_mpjpe_2d_counts_what_both_saw() -> None:
    truth = np.zeros((2, 2, 2))
    points = np.array([[[3.0, 4.0], [np.nan, np.nan]], [[0.0, 1.0], [0.0, 0.0]]])
    assert pose.mean_known(pose.distances(points, truth), (0, 1)) == pytest.approx(2.0)
    assert np.isnan(pose.mean_known(pose.distances(np.full_like(truth, np.nan), truth), (0, 1)))


def test_unknown_joints_are_left_out(walk: Array) -> None:
    moved = walk + np.array([0.0, 0.0, 0.1])
    moved[5, 3], moved[9] = np.nan, np.nan
    assert mean(pose.distances(moved, walk)) == pytest.approx(0.1)
    assert np.isnan(mean(pose.distances(np.full_like(walk, np.nan), walk)))


def test_errors_do_not_change_when_both_move_together(walk: Array, rng: np.random.Generator) -> None:
    moved = walk + 0.02 * rng.normal(size=walk.shape)
    together = pose.w_mpjpe_errors(turned(moved, 1.0), turned(walk, 1.0), first=False)
    np.testing.assert_allclose(together, pose.w_mpjpe_errors(moved, walk, first=False), atol=1e-9)
    np.testing.assert_allclose(
        pose.distances(turned(moved, 1.0), turned(walk, 1.0)), pose.distances(moved, walk), atol=1e-9
    )


def test_batches_give_the_errors_of_each(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 3, 6, 12, 3))
    roots = a[..., :2, :].mean(-2), b[..., :2, :].mean(-2)
    np.testing.assert_allclose(
        pose.mpjpe_pa_errors(a, b), [pose.mpjpe_pa_errors(x, y) for x, y in zip(a, b, strict=True)]
    )
    for errors in (pose.mpjpe_errors, pose.mpjpe_g_align1_errors, pose.pck_hits):
        each = [errors(*x) for x in zip(a, b, *roots, strict=True)]
        np.testing.assert_allclose(errors(a, b, *roots), each)
