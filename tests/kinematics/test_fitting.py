"""The whole kinematic fit: a known walk is seen by a camera and found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import kinematics, trust
from simrecon.errors import InputError
from simrecon.evidence import resample, sides
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.kinematics import fitting
from simrecon.kinematics.layout import LOG_SCALE, SEGMENTS, split
from simrecon.kinematics.objective import Objective
from simrecon.kinematics.observe import by_point, observe
from simrecon.kinematics.state import State
from simrecon.plan import Kinematics
from simrecon.types import Array, Camera, Evidence, KinematicFit, Scene, SceneItem
from tests.kinematics.conftest import Makers, Walk
from tests.support.panning import panning

T = 20
EYE, TARGET = np.array([4.0, -2.5, 1.4]), np.array([0.3, 0.1, 0.9])


@pytest.fixture(scope="module")
def walk(make: Makers) -> Walk:
    return make.walking(T)


@pytest.fixture(scope="module")
def camera(make: Makers) -> Camera:
    return make.looking_at(EYE, TARGET)


def points(fit: KinematicFit) -> Array:
    """(T, M, 3)."""
    return kinematics.configurations(fit.body, fit.qpos)[1]


def distance_m(fit: KinematicFit, walk: Walk) -> float:
    """Mean distance of the points from where they really were."""
    return float(np.linalg.norm(points(fit) - np.swapaxes(walk.points_m, 0, 1), axis=-1).mean())


def test_a_motion_is_recovered_from_noisy_evidence(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    evidence = replace(make.seen(walk, camera, noise_px=1.0, noise_m=0.01), height_m=1.75, mass_kg=72.0)
    fit = kinematics.fit(evidence, Scene(), weights)
    assert distance_m(fit, walk) < 0.02
    assert np.median(fit.reprojection_px) < 2.0
    np.testing.assert_allclose(fit.qpos[:, :3], walk.root_m, atol=0.04)
    angles = rotations.angle_between(fit.qpos[:, 3:7], rotations.exp(walk.rotvecs[0]))
    assert np.degrees(angles).mean() < 3.0
    assert bodies.stature_m(fit.body.skeleton) == pytest.approx(1.75, rel=0.02)
    assert fit.body.mass_kg == 72.0
    assert fit.body.height_m == 1.75
    assert not fit.interpolated.any()
    assert fit.qpos.shape == (T, 71)
    np.testing.assert_allclose(np.linalg.norm(fit.qpos[:, 3:].reshape(T, SEGMENTS, 4), axis=-1), 1.0)


def test_size_stays_near_the_answer_while_poses_are_found(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes = []

    class Watched(Objective):
        def __call__(self, x: Array, state: State | None = None) -> tuple[float, Array]:
            sizes.append(float(np.exp(split(x, T)[2][LOG_SCALE])))
            return super().__call__(x, state)

    monkeypatch.setattr(fitting, "Objective", Watched)
    evidence = replace(make.seen(walk, camera, noise_px=1.0, noise_m=0.01), height_m=1.75)
    kinematics.fit(evidence, Scene(), weights)
    assert min(sizes) > 0.99 * sizes[-1]  # 0.98 if it is free from the start; in real clips down to 0.6


def test_left_and_right_mixed_up_in_a_run_of_frames_cost_nothing(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    clean = make.seen(walk, camera, noise_px=1.0, noise_m=0.01)
    points, joints = clean.keypoints_px.copy(), clean.joints_m.copy()
    for limbs in sides.LIMBS:
        index, at = sides.pairs(clean.joint_names, limbs), np.arange(7, 12)[:, None]
        for values in (points, joints):
            values[at, index.ravel()] = values[at, index[:, ::-1].ravel()]
    mixed = replace(clean, keypoints_px=points, joints_m=joints)
    usual, repaired, without = (
        distance_m(kinematics.fit(clip, Scene(), weights), walk)
        for clip in (clean, resample(mixed)[0], mixed)
    )
    assert repaired == pytest.approx(usual, rel=0.05)
    assert without > 2 * usual


def test_the_size_of_the_person_is_measured_where_the_floor_is_known(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    fit = kinematics.fit(make.seen(walk, camera, noise_m=0.01), Scene(), weights)
    assert bodies.stature_m(fit.body.skeleton) == pytest.approx(1.75, rel=0.02)
    assert distance_m(fit, walk) < 0.035  # a stature of 1.7 m is more usual, which is 2 cm in depth


def test_the_frame_of_the_3d_estimate_does_not_matter(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    evidence = replace(make.seen(walk, camera), height_m=1.75)
    for clip in (
        evidence,
        make.in_camera(evidence, relative=False),
        make.in_camera(evidence, relative=True),
    ):
        fit = kinematics.fit(clip, Scene(), weights)
        assert distance_m(fit, walk) < 0.012, clip.joints_frame
        # the 3D estimate agrees with the image on where the person is
        assert fit.loss["place"] < 0.01, clip.joints_frame


def test_landmarks_alone_are_enough_with_extrinsics(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    evidence = make.seen(walk, camera)
    flat = replace(
        evidence, joint_names=(), joints_m=np.zeros((T, 0, 3)), joints_frame="world", height_m=1.75
    )
    fit = kinematics.fit(flat, Scene(), replace(weights, evaluations=800))
    assert np.median(fit.reprojection_px) < 8.0
    assert np.isfinite(fit.qpos).all()


def test_a_3d_estimate_alone_is_enough(make: Makers, walk: Walk, camera: Camera, weights: Kinematics) -> None:
    evidence = make.seen(walk, camera, noise_m=0.01)
    blind = replace(
        evidence, keypoint_names=(), keypoints_px=np.zeros((T, 0, 2)), scores=np.zeros((T, 0)), camera=None
    )
    fit = kinematics.fit(blind, Scene(), weights)
    assert fit.camera is None
    assert fit.reprojection_px.shape == (T, 0)
    # place weighs little against feet that slide, which real ones don't
    assert distance_m(fit, walk) < 0.05


@pytest.mark.parametrize("relative", [False, True], ids=["camera", "camera_root_relative"])
def test_without_a_camera_its_frame_is_taken_for_level(
    make: Makers, weights: Kinematics, relative: bool
) -> None:
    walk = make.walking(T)
    level = make.looking_at(np.array([4.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]))
    evidence = make.in_camera(make.seen(walk, level), relative)
    blind = replace(
        evidence, keypoint_names=(), keypoints_px=np.zeros((T, 0, 2)), scores=np.zeros((T, 0)), camera=None
    )
    marks = points(kinematics.fit(blind, Scene(), weights))
    up = (
        marks[:, walk.skeleton.point_names.index("nose")]
        - marks[:, walk.skeleton.point_names.index("left_ankle")]
    )
    assert (up[:, 2] > 1.2).all()


def test_frames_out_of_view_are_bridged(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    evidence = replace(make.seen(walk, camera), height_m=1.75)
    gap = slice(8, 12)
    for key in ("keypoints_px", "joints_m"):
        values = getattr(evidence, key).copy()
        values[gap] = np.nan
        evidence = replace(evidence, **{key: values})
    fit = kinematics.fit(evidence, Scene(), weights)
    assert np.flatnonzero(fit.interpolated).tolist() == [8, 9, 10, 11]
    off = np.linalg.norm(points(fit) - np.swapaxes(walk.points_m, 0, 1), axis=-1).mean(axis=1)  # (T,)
    assert off[gap].max() < 0.06
    assert np.delete(off, range(8, 12)).mean() < 0.015
    assert np.isnan(fit.reprojection_px[gap]).all()
    assert np.isfinite(np.delete(fit.reprojection_px, range(8, 12), axis=0)).all()


def up_in_camera(fit: KinematicFit) -> Array:
    assert fit.camera is not None
    return cameras.extrinsics(fit.camera)[0, :3, 2]


@pytest.mark.parametrize("height_m", [1.0, 2.2], ids=["level", "tilted"])
def test_the_floor_is_found_without_extrinsics(make: Makers, weights: Kinematics, height_m: float) -> None:
    # towards the camera: across the direction of walking nothing tells how the floor slopes
    walk = make.walking(45, 15.0, heading_rad=0.0)
    eye = np.array([6.0, 0.0, height_m])
    camera = make.looking_at(eye, np.array([2.0, 0.0, 1.0]))
    known = make.in_camera(make.seen(walk, camera, noise_px=0.5, noise_m=0.005), relative=True)
    evidence = replace(known, camera=Camera(camera.lens), height_m=1.75)
    fit = kinematics.fit(evidence, Scene(), weights)
    angle = np.degrees(np.arccos(up_in_camera(fit) @ cameras.extrinsics(camera)[0, :3, 2]))
    assert angle < 3.0
    # lowest points of the feet are on the floor in every frame
    rows = [
        walk.skeleton.point_names.index(f"{side}_{end}")
        for side in ("left", "right")
        for end in ("heel", "toe")
    ]
    lowest = points(fit)[:, rows, 2].min(axis=1)
    assert np.abs(lowest).mean() < 0.03
    # and the camera is as high as it really was
    assert fit.camera is not None
    assert cameras.centre_m(fit.camera)[0, 2] == pytest.approx(height_m, abs=0.25)
    assert np.median(fit.reprojection_px) < 3.0


def test_no_known_point_is_an_error(make: Makers, walk: Walk, camera: Camera, weights: Kinematics) -> None:
    evidence = make.seen(walk, camera)
    unseen = replace(
        evidence,
        keypoints_px=np.full_like(evidence.keypoints_px, np.nan),
        joints_m=np.full_like(evidence.joints_m, np.nan),
    )
    with pytest.raises(InputError, match="no point of the body"):
        kinematics.fit(unseen, Scene(), weights)


def test_points_named_twice_are_averaged_and_ignored_names_are(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    evidence = replace(make.seen(walk, camera), height_m=1.75)
    toe = evidence.keypoint_names.index("left_toe")
    extra: Evidence = replace(
        evidence,
        keypoint_names=(*evidence.keypoint_names, "left_foot_index", "spine3"),
        keypoints_px=np.concatenate((evidence.keypoints_px, evidence.keypoints_px[:, [toe, toe]]), axis=1),
        scores=np.ones((T, len(evidence.keypoint_names) + 2)),
    )
    few = replace(weights, evaluations=30)
    fit = kinematics.fit(extra, Scene(), few)
    np.testing.assert_allclose(fit.qpos, kinematics.fit(evidence, Scene(), few).qpos, atol=1e-9)
    assert np.isnan(fit.reprojection_px[:, -1]).all()
    np.testing.assert_array_equal(fit.reprojection_px[:, -2], fit.reprojection_px[:, toe])


def test_letters_of_the_ablation(make: Makers, walk: Walk, camera: Camera, weights: Kinematics) -> None:
    """Without T frames are on their own, without O nothing is searched, without S proportions are average."""
    evidence = replace(make.seen(walk, camera, noise_px=4.0, noise_m=0.03), height_m=1.75)
    few = replace(weights, evaluations=150)
    full = kinematics.fit(evidence, Scene(), few)
    alone = kinematics.fit(evidence, Scene(), replace(few, temporal=False))
    start = kinematics.fit(evidence, Scene(), replace(few, poses=False))
    jerk = [np.abs(np.diff(points(fit), 3, axis=0)).mean() for fit in (full, alone)]
    assert jerk[0] < 0.5 * jerk[1]
    assert start.iterations == 0
    assert distance_m(full, walk) < distance_m(start, walk)
    assert kinematics.fit(evidence, Scene(), replace(few, ground=False)).loss["contact"] == 0.0


def test_a_lean_of_the_3d_estimate_is_no_lean_of_the_person(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    evidence = replace(make.seen(walk, camera, noise_px=1.0), height_m=1.75)
    towards = rotations.matrix(rotations.exp(0.12 * cameras.extrinsics(camera)[0, 0, :3]))
    root = walk.root_m[:, None]
    leaning = replace(evidence, joints_m=(evidence.joints_m - root) @ towards.T + root)
    fit = kinematics.fit(leaning, Scene(), weights)
    names = walk.skeleton.point_names
    trunk = points(fit)[:, names.index("nose")] - points(fit)[:, names.index("left_ankle")]
    true = walk.at("nose")[:, 0] - walk.at("left_ankle")[:, 0]
    across = cameras.extrinsics(camera)[0, 2, :3]
    assert np.abs((trunk - true) @ across).mean() < 0.5 * 0.12 * 1.5


def test_a_panning_camera_costs_no_accuracy(make: Makers, weights: Kinematics) -> None:
    """The same walk with the same noise, before a camera that stands and one that pans by 26° and moves."""
    walk = make.walking(60)
    still = make.looking_at(np.array([5.0, -1.5, 1.4]), np.array([1.0, 0.5, 0.9]))
    moving = panning(still, walk.frames)
    off = []
    for camera in (still, moving):
        evidence = replace(make.seen(walk, camera, noise_px=4.0, noise_m=0.05), height_m=1.75)
        fit = kinematics.fit(evidence, Scene(), weights)
        assert fit.camera is not None
        assert fit.camera.path is not None
        assert fit.camera.path.shape == (walk.frames, 4, 4)
        true = np.swapaxes(walk.points_m, 0, 1)
        off.append(np.linalg.norm(points(fit) - true, axis=-1).mean())
    assert off[1] < 1.1 * off[0]


def test_feet_that_stand_are_known_before_a_panning_camera(make: Makers, weights: Kinematics) -> None:
    walk = make.walking(60)
    still = make.looking_at(np.array([5.0, -1.5, 1.4]), np.array([1.0, 0.5, 0.9]))
    standing = []
    for camera in (still, panning(still, walk.frames)):
        evidence = make.seen(walk, camera)
        skeleton = walk.skeleton
        worth = trust.of(evidence)
        see = observe(evidence, skeleton, by_point(evidence, skeleton), evidence.camera, weights, worth, 0.1)
        standing.append(see.standing)
    assert standing[0].max() > 0.5
    np.testing.assert_allclose(standing[1], standing[0], atol=0.15)


def test_a_path_in_a_world_without_a_known_ground_is_moved_with_it(
    make: Makers, walk: Walk, camera: Camera, weights: Kinematics
) -> None:
    carried = panning(camera, T)
    low = np.eye(4)
    low[2, 3] = 0.4  # the evidence's origin is in the air
    evidence = make.seen(walk, carried)
    evidence = replace(
        evidence,
        joints_m=evidence.joints_m - low[:3, 3],
        camera=cameras.with_path(carried, cameras.extrinsics(carried) @ low),
        ground_known=False,
        height_m=1.75,
    )
    fit = kinematics.fit(evidence, Scene(), weights)
    np.testing.assert_allclose(fit.qpos[:, 2], walk.root_m[:, 2], atol=0.04)
    assert fit.camera is not None
    np.testing.assert_allclose(cameras.centre_m(fit.camera), cameras.centre_m(carried), atol=0.04)
    assert np.median(fit.reprojection_px) < 4.0


def captured(walk: Walk, shift_m: Array) -> Evidence:
    """Nothing but joints in 3D, each frame (T, 3) shifted."""
    return Evidence(
        times_s=walk.times_s,
        keypoint_names=(),
        keypoints_px=np.empty((walk.frames, 0, 2)),
        scores=np.empty((walk.frames, 0)),
        joint_names=walk.skeleton.point_names,
        joints_m=np.swapaxes(walk.points_m, 0, 1) + shift_m[:, None],
        joints_frame="world",
        trust="mocap",
    )


def test_motion_capture_is_followed_onto_a_step_that_is_in_no_scene(walk: Walk, weights: Kinematics) -> None:
    rise = 0.3 * np.sin(np.linspace(0, np.pi, T)) ** 2
    high = captured(walk, np.outer(rise, [0.0, 0.0, 1.0]))
    fit = kinematics.fit(high, Scene(), weights)
    assert np.linalg.norm(points(fit) - high.joints_m, axis=-1).mean() < 0.01
    np.testing.assert_allclose(fit.qpos[:, 2] - walk.root_m[:, 2], rise, atol=0.01)


def test_the_floor_is_laid_under_motion_capture(walk: Walk, weights: Kinematics) -> None:
    low = captured(walk, np.tile([0.0, 0.0, -0.2], (T, 1)))
    fit = kinematics.fit(low, Scene(), weights)
    assert fit.scene.ground.height_m == pytest.approx(-0.2, abs=0.02)
    np.testing.assert_allclose(fit.qpos[:, 2], walk.root_m[:, 2] - 0.2, atol=0.01)


def test_motion_capture_shares_its_floor_with_a_scene(walk: Walk, weights: Kinematics) -> None:
    step = SceneItem("step", "box", (9.0, 0.0, 0.0), {"size_m": (0.4, 0.8, 0.12)})
    fit = kinematics.fit(captured(walk, np.tile([0.0, 0.0, 0.1], (T, 1))), Scene(items=(step,)), weights)
    assert fit.scene.ground.height_m == 0.0
    np.testing.assert_allclose(fit.qpos[:, 2], walk.root_m[:, 2] + 0.1, atol=0.02)


def test_motion_capture_settles_the_lengths_whatever_height_is_said(walk: Walk, weights: Kinematics) -> None:
    said = replace(captured(walk, np.zeros((T, 3))), height_m=1.9)
    fit = kinematics.fit(said, Scene(), weights)
    knee = fit.body.skeleton.names.index("left_ankle")
    ours, true = fit.body.skeleton.offsets_m[knee, 2], walk.skeleton.offsets_m[knee, 2]
    assert ours == pytest.approx(true, rel=0.01)
