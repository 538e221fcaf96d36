from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evaluation.accuracy import accuracy
from simrecon.evaluation.comparison import comparison, track
from simrecon.metrics.rates import covered_times
from simrecon.metrics.truth import BODY_JOINTS, FOOT_POINTS, read_truth
from simrecon.types import Array, Scene
from tests.support.standing import NAMES, standing

FPS = 10.0


@pytest.fixture
def pose(rng: np.random.Generator) -> Array:
    """(T, J, 3) any motion."""
    return rng.normal(size=(6, 12, 3))


def evaluate(
    times_s: Array,
    names: Sequence[str],
    joints_m: Array,
    truth_times_s: Array,
    truth_names: Sequence[str],
    truth_joints_m: Array,
) -> dict[str, float]:
    """`covered` and the scores of `accuracy` on a level floor."""
    motion = track(times_s, names, joints_m, "motion")
    truth = track(truth_times_s, truth_names, truth_joints_m, "reference")
    times = covered_times(motion.times_s, truth.times_s)
    on = comparison(truth, times, Scene(), [point for point in FOOT_POINTS if point in motion.names])
    return {"covered": len(times) / len(truth_times_s), **accuracy(motion, on).values}


def test_skating_of_feet_at_rest_by_hand() -> None:
    """A body 1 cm too high, all of whose points move at 1 m/s in five of ten steps."""
    times = np.arange(11) / FPS
    truth = np.repeat(standing()[None], 11, axis=0)
    motion = truth + np.array([0.0, 0.0, 0.01])
    motion[6:] += 0.1 * np.arange(1, 6)[:, None, None] * [1.0, 0.0, 0.0]
    scores = evaluate(times, NAMES, motion, times, NAMES, truth)
    by_hand = {"foot_contact_frames": 40, "footskate_pct": 50, "foot_slide_mps": 0.5}
    by_hand |= {"foot_slide_truth_mps": 0, "foot_height_err_mm": 10}
    assert {name: scores[name] for name in by_hand} == pytest.approx(by_hand)
    feet = [*BODY_JOINTS, "left_heel"]  # one point, at rest in five steps
    few = evaluate(times[:6], feet, motion[:6, :13], times[:6], feet, truth[:6, :13])
    assert "foot_contact_frames" not in few


def test_evaluate_matches_names_and_interpolates_times(rng: np.random.Generator) -> None:
    """A motion of constant velocity, sampled at other times and in another order, and 30 mm off."""
    start, speed = rng.normal(size=(16, 3)), rng.normal(size=(16, 3))
    truth_times, times = np.arange(21) / 10, 0.5 + np.arange(40) / 37
    order = rng.permutation(16)
    names = [NAMES[i].replace("_toe", "_foot_index") for i in order]
    truth = start + truth_times[:, None, None] * speed
    motion = (start + times[:, None, None] * speed)[:, order] + [0.0, 0.03, 0.0]
    scores = evaluate(times, names, motion, truth_times, NAMES, truth)
    assert scores["covered"] == pytest.approx(11 / 21)
    assert scores["mpjpe_g_mm"] == pytest.approx(30)
    assert scores["root_mm"] == pytest.approx(30)
    for name in ("mpjpe", "mpjpe_pa", "mpjpe_g_align1"):
        assert scores[f"{name}_mm"] == pytest.approx(0, abs=1e-9)
    for name in ("velocity_mps", "velocity_gartner_mps", "accel_mps2"):
        assert scores[name] == pytest.approx(0, abs=1e-9)


def test_evaluate_without_foot_points_has_no_foot_scores(pose: Array) -> None:
    times = np.arange(6) / FPS
    scores = evaluate(times, BODY_JOINTS, pose, times, BODY_JOINTS, pose)
    assert not [name for name in scores if name.startswith("foot")]
    assert scores["mpjpe_g_mm"] == 0


def test_evaluate_refuses_what_it_cannot_compare(pose: Array) -> None:
    times, names = np.arange(6) / FPS, BODY_JOINTS
    with pytest.raises(InputError, match="of the motion: found no right_wrist; valid: all of left_hip"):
        evaluate(times, names[:-1], pose[:, :-1], times, names, pose)
    with pytest.raises(InputError, match="of the reference: found no right_wrist"):
        evaluate(times, names, pose, times, names[:-1], pose[:, :-1])
    with pytest.raises(InputError, match="found 0 frames of the reference"):
        evaluate(times + 9, names, pose, times, names, pose)


@pytest.mark.parametrize("clip", ["opencap_walk_ts", "synth_walk", "pose2sim_beam"])
def test_agrees_with_the_independent_check(
    shared_data: Path, tmp_path: Path, rng: np.random.Generator, clip: str
) -> None:
    script = shared_data.parent / "tools" / "evaluate.py"
    if not script.is_file():
        pytest.skip(f"no {script}")
    path = shared_data / "truth" / f"{clip}.npz"
    truth = read_truth(path)
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
    ours = evaluate(times, truth.joint_names, joints, truth.times_s, truth.joint_names, truth.joints_m)
    assert ours.pop("covered") == pytest.approx(theirs["covered"], abs=5.1e-4)
    assert ours.keys() >= theirs["result"].keys()
    ours = {name: ours[name] for name in theirs["result"]}
    assert ours == pytest.approx(theirs["result"], abs=6e-5, rel=0)
    assert ours["mpjpe_g_mm"] > 10
