"""What engines work on: targets, frames and observations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import kinematics
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Window
from tests.engines.conftest import Makers


def test_targets_are_the_pose_ahead_of_the_servos_lag(make: type[Makers]) -> None:
    problem = make.clip(make.settings())
    assert problem.targets_rad.shape == (problem.clock.steps + 1, 48)
    rotvecs = rotations.log(problem.qpos[:, 7:].reshape(-1, 16, 4)).reshape(-1, 48)
    still = np.ptp(rotvecs, axis=0) < 1e-12
    assert still.sum() == 46
    frames = problem.targets_rad[:: problem.clock.stride]
    np.testing.assert_allclose(frames[:, still], rotvecs[:, still], atol=1e-6)
    # the elbows' servos have d / k = 0.03 s and turn at one radian per second, first and last frame aside
    np.testing.assert_allclose((frames - rotvecs)[3:-3, ~still], 0.03, atol=0.001)


def test_targets_stay_within_reach_of_the_motors(make: type[Makers]) -> None:
    fit = make.standing()
    joints = rotations.exp(np.full((len(fit.qpos), 16, 3), 1.5))
    problem = make.clip(
        make.settings(),
        replace(fit, qpos=np.concatenate((fit.qpos[:, :7], joints.reshape(len(fit.qpos), -1)), axis=1)),
    )
    low, high = problem.model.actuator_ctrlrange.T
    assert (problem.targets_rad >= low).all()
    assert (problem.targets_rad <= high).all()
    assert (problem.targets_rad == high).any()


def test_kinematic_targets_are_those_of_the_fit(make: type[Makers]) -> None:
    fit = make.standing()
    problem = make.clip(make.settings(), fit)
    np.testing.assert_array_equal(problem.orientations[:, 0], fit.qpos[:, 3:7])
    np.testing.assert_array_equal(problem.com_m, fit.com_m)
    np.testing.assert_array_equal(problem.points_m, kinematics.configurations(fit.body, fit.qpos)[1])
    names = [problem.model.site(row).name for row in problem.point_rows]
    assert tuple(names) == fit.body.skeleton.point_names
    assert {names[row] for row in problem.joint_rows} >= {"pelvis", "neck", "left_knee", "right_wrist"}
    assert not {names[row] for row in problem.joint_rows} & {"nose", "left_heel", "right_toe", "head"}
    assert problem.model.opt.timestep == problem.clock.step_s
    np.testing.assert_allclose(problem.qvel0[:6], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("rate_hz", "frames"), [(30.0, [3, 4, 5, 6, 7, 8]), (15.0, [3, 5, 7, 8]), (8.0, [3, 7, 8])]
)
def test_the_loss_looks_at_both_ends_of_a_window(
    make: type[Makers], rate_hz: float, frames: list[int]
) -> None:
    problem = make.clip(make.settings(rate_hz=rate_hz))
    stride = problem.clock.stride
    assert problem.frames(Window(0, 3 * stride, 5 * stride, 8 * stride)).tolist() == frames
    assert problem.interval_s == pytest.approx((frames[1] - frames[0]) / 30)


def test_observations_are_by_point_of_the_body(make: type[Makers]) -> None:
    fit = make.standing(make.camera)
    skeleton = fit.body.skeleton
    points = kinematics.configurations(fit.body, fit.qpos)[1]
    names = ("RBigToe", "Nose", "right_foot_index", "spine3", "LHeel")
    toe, nose, heel = (skeleton.point_names.index(name) for name in ("right_toe", "nose", "left_heel"))
    pixels = cameras.project(make.camera, points[:, [toe, nose, toe, nose, heel]])
    pixels[4, 1] = np.nan
    scores = np.tile([0.5, 0.9, 0.2, 1.0, 0.05], (len(points), 1))
    evidence = replace(
        make.unseen(), keypoint_names=names, keypoints_px=pixels, scores=scores, camera=make.camera
    )
    problem = make.clip(make.settings(), fit, evidence)
    ideal = cameras.to_camera(make.camera, points)
    ideal = ideal[..., :2] / ideal[..., 2:]
    np.testing.assert_allclose(problem.rays[:, toe], ideal[:, toe], atol=1e-7)
    np.testing.assert_allclose(problem.scores[:, toe], 0.7)
    np.testing.assert_allclose(
        np.delete(problem.rays[:, nose], 4, axis=0), np.delete(ideal[:, nose], 4, axis=0), atol=1e-7
    )
    assert problem.scores[4, nose] == 0.0
    assert problem.scores[:, heel].max() == 0.0
    assert np.isfinite(problem.rays).all()
    assert (problem.scores > 0).sum() == 2 * len(points) - 1


def test_a_camera_that_stands_still_has_the_same_row_at_every_frame(make: type[Makers]) -> None:
    fit = make.standing(make.camera)
    problem = make.clip(make.settings(), fit)
    assert problem.world_to_camera is not None
    assert problem.world_to_camera.shape == (len(fit.times_s), 4, 4)
    assert make.camera.path is not None
    assert (problem.world_to_camera == make.camera.path[0]).all()
    assert make.clip(make.settings()).world_to_camera is None


def test_the_path_of_a_camera_that_moves_is_kept(make: type[Makers]) -> None:
    fit = make.standing(make.camera)
    assert fit.camera is not None
    assert fit.camera.path is not None
    path = np.tile(fit.camera.path[0], (len(fit.times_s), 1, 1))
    path[:, 0, 3] += np.linspace(0.0, 1.0, len(path))
    moving = replace(fit, camera=replace(fit.camera, path=path))
    np.testing.assert_array_equal(make.clip(make.settings(), moving).world_to_camera, path)
