from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon import metrics
from simrecon.errors import InputError
from simrecon.geometry import rotations
from simrecon.types import Array

FPS = 10.0


@pytest.fixture
def pose(rng: np.random.Generator) -> Array:
    """(T, J, 3) any motion."""
    return rng.normal(size=(6, 12, 3))


def test_mpjpe_g_is_the_mean_distance(pose: Array) -> None:
    moved = pose.copy()
    moved[:, :6] += [0.03, 0.0, 0.04]
    assert metrics.mpjpe_g(moved, pose) == pytest.approx(0.025)
    assert metrics.mpjpe_g(pose, pose) == 0


def test_mpjpe_ignores_the_root_of_each_frame_and_align1_of_the_first(pose: Array) -> None:
    root = pose[:, :2].mean(1)
    drift = np.linspace(1, 2, 6)[:, None] * np.array([1.0, 0, 0])  # (T, 3) 1 m at the start, 2 m at the end
    moved = pose + drift[:, None]
    assert metrics.mpjpe(moved, pose, root + drift, root) == pytest.approx(0, abs=1e-12)
    assert metrics.mpjpe_g_align1(moved, pose, root + drift, root) == pytest.approx(0.5)
    assert metrics.mpjpe_g(moved, pose) == pytest.approx(1.5)
    assert metrics.root_error(root + drift, root) == pytest.approx(1.5)


@given(st.floats(0.1, 10), st.integers(0, 2**31))
def test_procrustes_undoes_any_similarity_of_each_frame(scale: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=(4, 12, 3))
    turn = rotations.matrix(rotations.exp(rng.normal(size=(4, 3))))  # (T, 3, 3)
    moved = scale * truth @ np.swapaxes(turn, -1, -2) + rng.normal(size=(4, 1, 3))
    np.testing.assert_allclose(metrics.procrustes(moved, truth), truth, atol=1e-9)
    assert metrics.mpjpe_pa(moved, truth) == pytest.approx(0, abs=1e-9)


def test_procrustes_does_not_mirror(pose: Array) -> None:
    assert metrics.mpjpe_pa(pose * [1, 1, -1], pose) > 0.1


def test_procrustes_of_one_point_is_the_centre(pose: Array) -> None:
    collapsed = metrics.procrustes(np.zeros_like(pose), pose)
    np.testing.assert_allclose(collapsed, np.broadcast_to(pose.mean(1, keepdims=True), pose.shape))


def test_mpjpe_2d_counts_what_both_saw() -> None:
    truth = np.zeros((2, 2, 2))
    points = np.array([[[3.0, 4.0], [np.nan, np.nan]], [[0.0, 1.0], [0.0, 0.0]]])
    assert metrics.mpjpe_2d(points, truth) == pytest.approx(2.0)
    assert np.isnan(metrics.mpjpe_2d(np.full_like(truth, np.nan), truth))


def test_the_two_velocity_errors_differ_on_a_turned_path() -> None:
    """Reference walks along x at 2 m/s, the motion along y at 1 m/s."""
    time = np.arange(5) / FPS
    truth = time[:, None, None] * np.array([2.0, 0, 0]) * np.ones((1, 3, 1))
    joints = time[:, None, None] * np.array([0.0, 1, 0]) * np.ones((1, 3, 1)) + 7.0
    assert metrics.velocity(joints, truth, 1 / FPS) == pytest.approx(np.sqrt(5))
    assert metrics.velocity_gartner(joints, truth, 1 / FPS) == pytest.approx(1.0)
    assert metrics.acceleration(joints, truth, 1 / FPS) == pytest.approx(0, abs=1e-9)


def test_acceleration_of_free_fall() -> None:
    fall = np.zeros((6, 2, 3))
    fall[..., 2] = -0.5 * 9.81 * (np.arange(6)[:, None] / FPS) ** 2
    assert metrics.acceleration(fall, np.zeros_like(fall), 1 / FPS) == pytest.approx(9.81)


def test_batches_give_the_scores_of_each(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 3, 6, 12, 3))
    roots = a[..., :2, :].mean(-2), b[..., :2, :].mean(-2)
    for score in (
        metrics.mpjpe_g, metrics.mpjpe_pa, lambda x, y: metrics.velocity(x, y, 0.1),
        lambda x, y: metrics.velocity_gartner(x, y, 0.1), lambda x, y: metrics.acceleration(x, y, 0.1),
    ):  # fmt: skip
        np.testing.assert_allclose(score(a, b), [score(x, y) for x, y in zip(a, b, strict=True)])
    for relative in (metrics.mpjpe, metrics.mpjpe_g_align1):
        each = [relative(*x) for x in zip(a, b, *roots, strict=True)]
        np.testing.assert_allclose(relative(a, b, *roots), each)


def test_box_clearance_of_a_tilted_box() -> None:
    half = np.array([0.1, 0.05, 0.02])
    flat, tilted = np.eye(3), rotations.matrix(rotations.exp([0.0, np.pi / 2, 0.0]))
    position = np.array([0.0, 0.0, 0.3])
    got = metrics.box_clearance(np.stack((position, position)), np.stack((flat, tilted)), half, support=0.05)
    np.testing.assert_allclose(got, [0.3 - 0.02 - 0.05, 0.3 - 0.1 - 0.05])


def feet(steps_m: list[float]) -> Array:
    """(T, 2, 3): the left foot moves along x by each step, the right one rests."""
    points = np.zeros((len(steps_m) + 1, 2, 3))
    points[1:, 0, 0] = np.cumsum(steps_m)
    return points


def test_footskate_needs_contact_and_two_centimetres() -> None:
    points = feet([0.0, 0.03, 0.01, 0.03])
    clearance = np.zeros((5, 2))
    assert metrics.footskate_pct(points, clearance) == pytest.approx(50)
    clearance[4, 0] = 0.006  # lifts during the last step
    assert metrics.footskate_pct(points, clearance) == pytest.approx(25)
    assert metrics.footskate_pct(points, clearance, metrics.CONTACT_DYNAMICS_M) == 0
    assert metrics.footskate_pct(points, clearance - 0.03, metrics.CONTACT_DYNAMICS_M) == pytest.approx(50)


def test_float_counts_feet_just_above_the_ground() -> None:
    clearance = np.array([[0.0, 0.5], [0.01, 0.0], [0.03, 0.03], [0.0051, 0.5]])
    assert metrics.float_pct(clearance) == pytest.approx(50)
    assert metrics.float_pct(clearance, metrics.CONTACT_DYNAMICS_M) == pytest.approx(75)


def test_penetration_is_below_the_floor_only() -> None:
    mean, deepest = metrics.penetration(np.array([[0.1, -0.002, -0.006, 0.0]]))
    np.testing.assert_allclose((mean, deepest), [[0.002], [0.006]])


def test_reference_contacts_are_low_and_slow() -> None:
    points = np.zeros((30, 1, 3))
    points[10:20, 0, 2] = 0.2  # lifted
    points[20:, 0, 0] = 0.1 * np.arange(10)  # slides at 1 m/s
    contact = metrics.reference_contacts(points, 1 / FPS)
    np.testing.assert_array_equal(np.flatnonzero(contact), np.arange(9))


def test_foot_metrics_by_hand() -> None:
    truth = np.zeros((11, 1, 3))
    foot = truth.copy()
    foot[:, 0, 2] = 0.01
    foot[6:, 0, 0] = 0.1 * np.arange(1, 6)  # five of ten steps at 1 m/s
    assert metrics.foot_metrics(foot, truth, 1 / FPS) == pytest.approx(
        {"foot_contact_frames": 10, "footskate_pct": 50, "foot_slide_mps": 0.5, "foot_slide_truth_mps": 0,
         "foot_height_err_mm": 10}
    )  # fmt: skip
    assert metrics.foot_metrics(foot[:6], truth[:6], 1 / FPS) == {}
    assert metrics.foot_metrics(foot[:, :0], truth[:, :0], 1 / FPS) == {}


NAMES = (*metrics.BODY_JOINTS, *metrics.FOOT_POINTS)


def test_body_joints_start_with_the_hips() -> None:
    assert len(set(metrics.BODY_JOINTS)) == 12
    assert metrics.BODY_JOINTS[:2] == ("left_hip", "right_hip")


def test_evaluate_matches_names_and_interpolates_times(rng: np.random.Generator) -> None:
    """A motion of constant velocity, sampled at other times and in another order, and 30 mm off."""
    start, speed = rng.normal(size=(16, 3)), rng.normal(size=(16, 3))
    truth_times, times = np.arange(21) / 10, 0.5 + np.arange(40) / 37
    order = rng.permutation(16)
    names = [NAMES[i].replace("_toe", "_foot_index") for i in order]
    truth = start + truth_times[:, None, None] * speed
    motion = (start + times[:, None, None] * speed)[:, order] + [0.0, 0.03, 0.0]
    scores = metrics.evaluate(times, names, motion, truth_times, NAMES, truth)
    assert scores["covered"] == pytest.approx(11 / 21)
    assert scores["mpjpe_g_mm"] == pytest.approx(30)
    assert scores["root_mm"] == pytest.approx(30)
    for name in ("mpjpe", "mpjpe_pa", "mpjpe_g_align1"):
        assert scores[f"{name}_mm"] == pytest.approx(0, abs=1e-9)
    for name in ("velocity_mps", "velocity_gartner_mps", "accel_mps2"):
        assert scores[name] == pytest.approx(0, abs=1e-9)


def test_evaluate_without_foot_points_has_no_foot_scores(pose: Array) -> None:
    times = np.arange(6) / FPS
    scores = metrics.evaluate(times, metrics.BODY_JOINTS, pose, times, metrics.BODY_JOINTS, pose)
    assert not [name for name in scores if name.startswith("foot")]
    assert scores["mpjpe_g_mm"] == 0


def test_evaluate_refuses_what_it_cannot_compare(pose: Array) -> None:
    times, names = np.arange(6) / FPS, metrics.BODY_JOINTS
    with pytest.raises(InputError, match="of the motion: found no right_wrist; valid: all of left_hip"):
        metrics.evaluate(times, names[:-1], pose[:, :-1], times, names, pose)
    with pytest.raises(InputError, match="of the reference: found no right_wrist"):
        metrics.evaluate(times, names, pose, times, names[:-1], pose[:, :-1])
    with pytest.raises(InputError, match="found 0 frames of the reference"):
        metrics.evaluate(times + 9, names, pose, times, names, pose)


def test_read_truth(tmp_path: Path, pose: Array) -> None:
    path = tmp_path / "truth.npz"
    arrays = {
        "schema": "simrecon.truth/1",
        "times_s": np.arange(6) / FPS,
        "joint_names": np.array(metrics.BODY_JOINTS),
        "joints_m": pose,
        "peer_names": np.array(["other"]),
    }
    np.savez(path, **arrays)
    truth = metrics.read_truth(path)
    assert truth.joint_names == metrics.BODY_JOINTS
    np.testing.assert_array_equal(truth.joints_m, pose)
    for key, value in (
        ("schema", "simrecon.evidence/1"), ("times_s", arrays["times_s"][::-1]), ("joints_m", pose[:5]),
        ("joints_m", np.where(pose > 1, np.nan, pose)), ("joint_names", np.array(["a"] * 12)),
    ):  # fmt: skip
        np.savez(path, **arrays | {key: value})
        with pytest.raises(InputError, match=f"truth.npz: {key}: found"):
            metrics.read_truth(path)


@pytest.mark.parametrize("clip", ["opencap_walk_ts", "synth_walk", "pose2sim_beam"])
def test_agrees_with_the_independent_check(
    shared_data: Path, tmp_path: Path, rng: np.random.Generator, clip: str
) -> None:
    script = shared_data.parent / "tools" / "evaluate.py"
    if not script.is_file():
        pytest.skip(f"no {script}")
    path = shared_data / "truth" / f"{clip}.npz"
    truth = metrics.read_truth(path)
    times = truth.times_s[0] + np.arange(0.02, 0.9 * np.ptp(truth.times_s), 0.011)
    series = truth.joints_m.reshape(len(truth.times_s), -1).T  # (K * 3, T)
    joints = np.stack([np.interp(times, truth.times_s, x) for x in series], axis=-1)
    joints = joints.reshape(len(times), -1, 3)
    joints = 1.02 * joints + rng.normal(scale=0.004, size=joints.shape) + [0.05, 0.0, 0.01]
    np.savez(tmp_path / "motion.npz", times_s=times, joint_names=np.array(truth.joint_names), joints_m=joints)
    run = subprocess.run(
        [sys.executable, script, tmp_path, path], capture_output=True, text=True, check=True, timeout=60
    )
    theirs = json.loads(run.stdout)
    ours = metrics.evaluate(
        times, truth.joint_names, joints, truth.times_s, truth.joint_names, truth.joints_m
    )
    assert ours.pop("covered") == pytest.approx(theirs["covered"], abs=5.1e-4)
    assert ours.keys() >= theirs["result"].keys()
    ours = {name: ours[name] for name in theirs["result"]}
    assert ours == pytest.approx(theirs["result"], abs=6e-5, rel=0)
    assert ours["mpjpe_g_mm"] > 10
