"""Forward kinematics against MuJoCo's, and its adjoint against finite differences."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from simrecon import body as bodies
from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.kinematics.layout import SEGMENTS, to_qpos
from simrecon.types import Array, Body, Skeleton

T = 6


@pytest.fixture(scope="module")
def person() -> Body:
    return bodies.build(bodies.scaled({}, 1.8), height_m=1.8, mass_kg=75.0, sole_m=0.0)


@pytest.fixture(scope="module")
def model(person: Body) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(person.mjcf)


def read_back(model: mujoco.MjModel, skeleton: Skeleton) -> Skeleton:
    """The skeleton with the six digits that its MJCF keeps."""
    sites = [model.site(name).id for name in skeleton.point_names]
    assert [model.body(i).name for i in range(1, 1 + SEGMENTS)] == list(skeleton.names)
    return replace(
        skeleton,
        offsets_m=model.body_pos[1:],
        rest=model.body_quat[1:],
        point_offsets_m=model.site_pos[sites],
        point_segments=model.site_bodyid[sites] - 1,
    )


def random_pose(rng: np.random.Generator) -> tuple[Array, Array, Array]:
    base = rotations.matrix(rotations.exp(rng.normal(size=(T, 3))))
    return rng.normal(size=(T, 3)), base, rng.uniform(-1.5, 1.5, (SEGMENTS, T, 3))


def mujoco_points(model: mujoco.MjModel, skeleton: Skeleton, qpos: Array) -> tuple[Array, Array]:
    """Points (M, T, 3) and origins of the segments (SEGMENTS, T, 3)."""
    data = mujoco.MjData(model)
    sites = [model.site(name).id for name in skeleton.point_names]
    points, origins = [], []
    for row in qpos:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        points.append(data.site_xpos[sites].copy())
        origins.append(data.xpos[1:].copy())
    return np.swapaxes(points, 0, 1), np.swapaxes(origins, 0, 1)


def test_points_are_where_mujoco_has_its_sites(
    person: Body, model: mujoco.MjModel, rng: np.random.Generator
) -> None:
    root, base, rotvecs = random_pose(rng)
    skeleton = read_back(model, person.skeleton)
    pose = forward.forward(skeleton, root, base, rotvecs, 1.0)
    points = forward.points(pose, skeleton.point_segments, skeleton.point_offsets_m)
    expected, origins = mujoco_points(model, skeleton, to_qpos(root, base, rotvecs))
    np.testing.assert_allclose(points, expected, atol=1e-9)
    np.testing.assert_allclose(pose.origins_m, origins, atol=1e-9)


def test_six_digits_of_mjcf_are_less_than_a_hundredth_of_a_millimetre(
    person: Body, model: mujoco.MjModel, rng: np.random.Generator
) -> None:
    root, base, rotvecs = random_pose(rng)
    pose = forward.forward(person.skeleton, root, base, rotvecs, 1.0)
    points = forward.points(pose, person.skeleton.point_segments, person.skeleton.point_offsets_m)
    expected, _ = mujoco_points(model, person.skeleton, to_qpos(root, base, rotvecs))
    np.testing.assert_allclose(points, expected, atol=1e-5)


def test_lengths_scale_about_the_root(person: Body, rng: np.random.Generator) -> None:
    root, base, rotvecs = random_pose(rng)
    unit = forward.forward(person.skeleton, root, base, rotvecs, 1.0)
    double = forward.forward(person.skeleton, root, base, rotvecs, 2.0)
    np.testing.assert_allclose(double.origins_m - root, 2 * (unit.origins_m - root), atol=1e-12)
    np.testing.assert_array_equal(double.axes, unit.axes)


def test_the_adjoint_is_the_transpose_of_the_derivative(person: Body, rng: np.random.Generator) -> None:
    root, base, rotvecs = random_pose(rng)
    skeleton = person.skeleton
    weight = rng.normal(size=(len(skeleton.point_names), T, 3))  # a loss that is linear in the points

    def loss(root: Array, rotvecs: Array) -> float:
        pose = forward.forward(skeleton, root, base, rotvecs, 1.1)
        return float(
            np.sum(weight * forward.points(pose, skeleton.point_segments, 1.1 * skeleton.point_offsets_m))
        )

    pose = forward.forward(skeleton, root, base, rotvecs, 1.1)
    points = forward.points(pose, skeleton.point_segments, 1.1 * skeleton.point_offsets_m)
    force, d_rotvecs = forward.adjoint(skeleton, pose, skeleton.point_segments, points, weight)
    for _ in range(30):
        move, turn = 1e-6 * rng.normal(size=root.shape), 1e-6 * rng.normal(size=rotvecs.shape)
        slope = loss(root + move, rotvecs + turn) - loss(root - move, rotvecs - turn)
        assert np.sum(force[0] * move) + np.sum(d_rotvecs * turn) == pytest.approx(
            slope / 2, rel=1e-5, abs=1e-10
        )
    for b in range(SEGMENTS):
        turn = np.zeros_like(rotvecs)
        turn[b] = 1e-6 * rng.normal(size=(T, 3))
        slope = loss(root, rotvecs + turn) - loss(root, rotvecs - turn)
        assert np.sum(d_rotvecs * turn) == pytest.approx(slope / 2, rel=1e-5, abs=1e-10)


@pytest.mark.parametrize("each", [True, False])
def test_points_are_rotated_by_the_matrix_of_their_frame(rng: np.random.Generator, each: bool) -> None:
    points = rng.normal(size=(5, 4, 3))
    matrices = rotations.matrix(rotations.exp(rng.normal(size=(4, 3) if each else 3)))
    expected = np.empty_like(points)
    for frame in range(4):
        expected[:, frame] = points[:, frame] @ (matrices[frame] if each else matrices).T
    np.testing.assert_allclose(forward.rotated(matrices, points), expected, atol=1e-14)
