"""Rotations: inverses of each other, derivatives, and the edges where formulas lose digits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation

from simrecon.geometry import rotations
from simrecon.types import Array

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])

axes = (
    hnp.arrays(float, 3, elements=st.floats(-1, 1))
    .filter(lambda v: np.linalg.norm(v) > 1e-3)
    .map(lambda v: v / np.linalg.norm(v))
)
angles = st.one_of(
    st.floats(0, math.pi - 1e-6), st.floats(0, 1e-7), st.floats(math.pi - 1e-3, math.pi - 1e-9)
)
rotvecs = st.builds(lambda axis, angle: angle * axis, axes, angles)
quats = rotvecs.map(rotations.exp)
vectors = hnp.arrays(float, 3, elements=st.floats(-10, 10))


@given(rotvecs)
def test_log_is_the_inverse_of_exp(v: Array) -> None:
    np.testing.assert_allclose(rotations.log(rotations.exp(v)), v, atol=1e-12)


@given(rotvecs)
def test_both_signs_of_a_quaternion_have_one_logarithm(v: Array) -> None:
    q = rotations.exp(v)
    assert np.linalg.norm(rotations.log(-q)) <= math.pi + 1e-15
    np.testing.assert_allclose(rotations.log(-q), v, atol=1e-12)


@given(st.floats(-20, 20), axes)
def test_exp_is_a_unit_quaternion_of_any_angle(angle: float, axis: Array) -> None:
    q = rotations.exp(angle * axis)
    np.testing.assert_allclose(np.linalg.norm(q), 1.0, atol=1e-14)
    reference = Rotation.from_rotvec(angle * axis).as_matrix()
    np.testing.assert_allclose(rotations.matrix(q), reference, atol=1e-12)


@given(quats)
def test_matrix_and_back(q: Array) -> None:
    quat = rotations.from_matrix(rotations.matrix(q))
    assert quat[0] >= 0
    np.testing.assert_allclose(quat * np.sign(quat @ q), q, atol=1e-12)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_of_a_matrix(axis: Array) -> None:
    m = 2 * np.outer(axis, axis) - np.eye(3)
    q = rotations.from_matrix(m)
    assert q[0] >= 0
    np.testing.assert_allclose(rotations.matrix(q), m, atol=1e-15)


@given(quats, quats, vectors)
def test_products_rotate_one_after_the_other(a: Array, b: Array, v: Array) -> None:
    product = rotations.multiply(a, b)
    np.testing.assert_allclose(
        rotations.rotate(product, v), rotations.rotate(a, rotations.rotate(b, v)), atol=1e-12
    )
    np.testing.assert_allclose(rotations.matrix(product) @ v, rotations.rotate(product, v), atol=1e-12)
    np.testing.assert_allclose(
        rotations.multiply(product, rotations.conjugate(product)), IDENTITY, atol=1e-14
    )


@given(vectors, vectors)
def test_skew_is_the_cross_product(a: Array, b: Array) -> None:
    np.testing.assert_allclose(rotations.skew(a) @ b, np.cross(a, b), atol=1e-12)


def test_canonical_has_unit_length_and_positive_w() -> None:
    quats = rotations.canonical([[-2.0, 0.0, 0.0, 2.0], [0.0, 3.0, 0.0, 0.0]])
    half = math.sqrt(0.5)
    np.testing.assert_allclose(quats, [[half, 0.0, 0.0, -half], [0.0, 1.0, 0.0, 0.0]])


@given(rotvecs, axes)
def test_left_jacobian_is_the_derivative_of_exp(v: Array, direction: Array) -> None:
    step = 1e-6 * direction
    ahead, behind = rotations.exp(v + step), rotations.exp(v - step)
    turned = rotations.log(rotations.multiply(ahead, rotations.conjugate(behind))) / 2e-6
    np.testing.assert_allclose(rotations.left_jacobian(v) @ direction, turned, atol=1e-8)


def test_left_jacobian_is_continuous_where_its_series_begins() -> None:
    axis = np.array([0.6, 0.0, -0.8])
    below, above = (rotations.left_jacobian(angle * axis) for angle in (0.99999e-4, 1.00001e-4))
    np.testing.assert_allclose(below, above, atol=1e-8)


@given(rotvecs.filter(lambda v: np.linalg.norm(v) < math.pi - 1e-2), axes)
def test_log_jacobian_is_the_derivative_of_log(v: Array, direction: Array) -> None:
    step = 1e-6 * direction
    ahead, behind = (
        rotations.log(rotations.multiply(rotations.exp(v), rotations.exp(sign * step))) for sign in (1, -1)
    )
    np.testing.assert_allclose(rotations.log_jacobian(v) @ direction, (ahead - behind) / 2e-6, atol=1e-8)


@given(rotvecs)
def test_log_jacobian_is_the_inverse_of_the_right_jacobian(v: Array) -> None:
    np.testing.assert_allclose(
        rotations.log_jacobian(v) @ rotations.left_jacobian(-v), np.eye(3), rtol=0, atol=1e-7
    )


def test_log_jacobian_is_continuous_where_its_series_begins_and_batched() -> None:
    axis = np.array([0.6, 0.0, -0.8])
    below, above = rotations.log_jacobian(np.array([[0.99999e-3], [1.00001e-3]]) * axis)
    np.testing.assert_allclose(below, above, atol=2e-8)
    many = np.random.default_rng(0).normal(size=(2, 5, 3))
    for i, j in np.ndindex(2, 5):
        np.testing.assert_array_equal(rotations.log_jacobian(many)[i, j], rotations.log_jacobian(many[i, j]))


@given(quats, quats, st.floats(0, 1))
def test_slerp_moves_at_constant_speed_on_the_shortest_path(a: Array, b: Array, fraction: float) -> None:
    between = rotations.slerp(a, b, fraction)
    whole = rotations.angle_between(a, b)
    # arccos keeps half of the digits near zero
    np.testing.assert_allclose(rotations.angle_between(a, between), fraction * whole, atol=1e-7)
    np.testing.assert_allclose(rotations.angle_between(between, b), (1 - fraction) * whole, atol=1e-7)
    np.testing.assert_allclose(rotations.slerp(a, -b, 1.0), rotations.slerp(a, b, 1.0), atol=1e-7)


def test_interpolation_meets_its_samples_and_holds_the_ends(rng: np.random.Generator) -> None:
    times_s = np.array([0.0, 0.1, 0.4, 0.5])
    q = rotations.exp(rng.normal(size=(4, 2, 3)))  # (T, 2, 4)
    at = rotations.interpolate(times_s, q, np.array([-1.0, 0.0, 0.1, 0.25, 0.5, 2.0]))
    np.testing.assert_allclose(
        rotations.angle_between(at[[0, 1, 2, 4, 5]], q[[0, 0, 1, 3, 3]]), 0.0, atol=1e-7
    )
    np.testing.assert_allclose(at[3], rotations.slerp(q[1], q[2], np.full(2, 0.5)))


def test_interpolation_of_plain_quaternions() -> None:
    quarter = rotations.exp(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, math.pi / 2]]))
    at = rotations.interpolate(np.array([0.0, 1.0]), quarter, np.array([0.5]))
    np.testing.assert_allclose(rotations.log(at), [[0.0, 0.0, math.pi / 4]], atol=1e-12)


@given(quats)
def test_alignment_recovers_a_rotation(q: Array) -> None:
    source = np.array([[1.0, 0.2, 0.0], [-0.5, 1.0, 0.3], [0.1, -0.7, 1.0], [0.3, 0.3, -0.4]])
    m = rotations.matrix(q)
    np.testing.assert_allclose(rotations.align(source, source @ m.T), m, atol=1e-9)


def test_alignment_never_reflects(rng: np.random.Generator) -> None:
    source = rng.normal(size=(20, 6, 3))
    rotation = rotations.align(source, source * [1.0, 1.0, -1.0])
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0)
    np.testing.assert_allclose(
        rotation @ np.swapaxes(rotation, -1, -2), np.broadcast_to(np.eye(3), (20, 3, 3)), atol=1e-12
    )
    # the mirrored direction is the one that the proper rotation gives up: no other rotation is nearer
    residual = np.sum((source @ np.swapaxes(rotation, -1, -2) - source * [1.0, 1.0, -1.0]) ** 2, axis=(1, 2))
    for other in rotations.matrix(rotations.exp(rng.normal(size=(50, 1, 3)))):
        assert (
            np.sum((source @ np.swapaxes(other, -1, -2) - source * [1.0, 1.0, -1.0]) ** 2, (1, 2))
            >= residual - 1e-9
        ).all()


def test_alignment_leaves_out_points_of_weight_zero(rng: np.random.Generator) -> None:
    source = rng.normal(size=(5, 3))
    m = rotations.matrix(rotations.exp(np.array([0.3, -1.0, 2.0])))
    target = source @ m.T
    target[4] += 10.0
    np.testing.assert_allclose(rotations.align(source, target, [1, 2, 3, 1, 0]), m, atol=1e-12)
    assert np.abs(rotations.align(source, target) - m).max() > 0.1


def test_angle_between_takes_the_short_way() -> None:
    a = rotations.exp(np.array([0.0, 0.0, 0.2]))
    b = rotations.exp(np.array([0.0, 0.0, -0.3]))
    np.testing.assert_allclose(rotations.angle_between(a, [b, -b]), [0.5, 0.5], atol=1e-12)
    assert rotations.angle_between(a, a) < 1e-7
    np.testing.assert_allclose(rotations.angle_between(IDENTITY, [0.0, 1.0, 0.0, 0.0]), math.pi)
