"""Pose priors: the Gaussian and the flow."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from simrecon import body as bodies
from simrecon import plan, prior, resources
from simrecon.errors import InputError, SimreconError
from simrecon.geometry import rotations
from simrecon.prior.flow_file import flow
from simrecon.types import Array, Skeleton


def t_pose_rotation(skeleton: Skeleton, mean_rad: Array, name: str) -> Array:
    """The mean as a rotation vector from the T-pose, degrees."""
    i = skeleton.names.index(name)
    turned = rotations.multiply(skeleton.rest[i], rotations.exp(mean_rad[i - 1]))
    return np.degrees(rotations.log(turned))


def test_the_mean_pose_is_usual_and_a_spread_away_is_one() -> None:
    gaussian = prior.gaussian(bodies.template())
    np.testing.assert_allclose(gaussian.latent(rotations.exp(gaussian.mean_rad)), 0.0, atol=1e-12)
    z = gaussian.latent(rotations.exp(gaussian.mean_rad + gaussian.spread_rad))
    np.testing.assert_allclose(z, 1.0, atol=1e-9)


def test_codes_are_batched_over_leading_axes(rng: np.random.Generator) -> None:
    gaussian = prior.gaussian(bodies.template())
    rotvecs = rng.uniform(-0.5, 0.5, (2, 3, 16, 3))
    z = gaussian.latent(rotations.exp(rotvecs))
    assert z.shape == (2, 3, 48)
    expected = (rotvecs - gaussian.mean_rad) / gaussian.spread_rad
    np.testing.assert_allclose(z, expected.reshape(2, 3, 48), atol=1e-9)


def test_the_mean_is_a_relaxed_stance() -> None:
    skeleton = bodies.template()
    mean = prior.gaussian(skeleton).mean_rad
    np.testing.assert_allclose(t_pose_rotation(skeleton, mean, "left_shoulder"), [-75, 0, -15], atol=1e-9)
    np.testing.assert_allclose(t_pose_rotation(skeleton, mean, "right_shoulder"), [75, 0, 15], atol=1e-9)
    np.testing.assert_allclose(t_pose_rotation(skeleton, mean, "right_knee"), [0, 15, 0], atol=1e-9)


def test_the_mean_is_within_the_limits_and_spreads_follow_the_ranges() -> None:
    skeleton = bodies.template()
    gaussian = prior.gaussian(skeleton)
    low, high = skeleton.limits_rad[..., 0], skeleton.limits_rad[..., 1]
    assert ((low < gaussian.mean_rad) & (gaussian.mean_rad < high)).all()
    np.testing.assert_allclose(gaussian.spread_rad, 0.25 * (high - low))


@pytest.fixture(scope="module")
def learned() -> prior.Flow:
    return prior.flow()


@pytest.fixture(scope="module")
def poses(learned: prior.Flow) -> Array:
    return learned.sample(np.random.default_rng(3), 6)


MODELS = tuple(plan.PRIORS)


@pytest.mark.parametrize("model", MODELS)
def test_a_plan_names_a_prior(model: str) -> None:
    chosen = prior.make(model, bodies.template())
    z = chosen.latent(rotations.exp(np.zeros((2, 16, 3))))
    assert z.shape == (2, 48)
    np.testing.assert_allclose(z[0], z[1])


def test_an_unknown_prior_is_refused() -> None:
    with pytest.raises(InputError, match="found 'gausian'; valid: gaussian, flow"):
        prior.make("gausian", bodies.template())


def slopes(function: Callable[[Array], Array], at: Array) -> Array:
    """Central differences by every component."""
    slope = np.empty_like(at)
    for i in np.ndindex(at.shape):
        step = np.zeros_like(at)
        step[i] = 1e-6
        slope[i] = (function(at + step)[i[0]] - function(at - step)[i[0]]) / 2e-6
    return slope


@pytest.mark.parametrize("model", MODELS)
def test_the_gradient_of_the_squared_norm_is_that_of_finite_differences(model: str, poses: Array) -> None:
    chosen = prior.make(model, bodies.template())
    value, gradient = chosen.squared(poses[:2])
    expected = slopes(lambda v: chosen.squared(v)[0], poses[:2])
    np.testing.assert_allclose(gradient, expected, atol=1e-6 * np.abs(expected).max())
    length = np.linalg.norm(chosen.latent(rotations.exp(poses[:2])), axis=-1)
    np.testing.assert_allclose(value, length**2, rtol=1e-4)


@pytest.mark.parametrize("model", MODELS)
def test_slopes_of_codes_are_those_of_finite_differences(model: str, poses: Array) -> None:
    chosen, few = prior.make(model, bodies.template()), poses[:4].reshape(2, 2, 16, 3)

    def code(rotvecs: Array) -> Array:
        if isinstance(chosen, prior.Flow):  # in double precision
            return chosen.code(rotvecs)
        return chosen.latent(rotations.exp(rotvecs))

    found, expected = chosen.slope(few), np.empty((2, 2, 48, 16, 3))
    for i in np.ndindex(16, 3):
        step = np.zeros((16, 3))
        step[i] = 1e-6
        expected[(..., *i)] = (code(few + step) - code(few - step)) / 2e-6
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(chosen.slope(few[0, 1]), found[0, 1], rtol=0, atol=1e-9)


def test_the_gradient_of_the_likelihood_is_that_of_finite_differences(
    learned: prior.Flow, poses: Array
) -> None:
    _, gradient = learned.log_likelihood(poses[:2])
    expected = slopes(lambda v: learned.log_likelihood(v)[0], poses[:2])
    np.testing.assert_allclose(gradient, expected, atol=1e-6 * np.abs(expected).max())
    # the check catches a gradient that lacks the volume's part
    lame = -0.5 * learned.squared(poses[:2])[1]
    assert np.abs(lame - expected).max() > 1e-2 * np.abs(expected).max()


def test_the_likelihood_is_that_of_the_change_of_variables(learned: prior.Flow, poses: Array) -> None:
    """log p(v) = log N(z) + log |det dz/dv|, the determinant by finite differences."""
    pose = poses[0]
    jacobian = np.empty((48, 48))
    for i in range(48):
        step = np.zeros(48)
        step[i] = 1e-6
        ahead, behind = (learned.code(pose + sign * step.reshape(16, 3)) for sign in (1, -1))
        jacobian[:, i] = (ahead - behind) / 2e-6
    z = learned.code(pose)
    expected = -0.5 * z @ z - 24 * np.log(2 * np.pi) + np.linalg.slogdet(jacobian)[1]
    assert learned.log_likelihood(pose)[0] == pytest.approx(expected, abs=1e-5)


def mirrored(rotvecs: Array) -> Array:
    """Left and right exchanged."""
    names = bodies.template().names[1:]
    other = [
        names.index(n.replace("left", "x").replace("right", "left").replace("x", "right")) for n in names
    ]
    return rotvecs[:, other] * np.array([-1.0, 1.0, -1.0])


def test_mirrored_poses_have_the_same_norm_and_likelihood(learned: prior.Flow, poses: Array) -> None:
    assert np.abs(poses - mirrored(poses)).max() > 0.1
    np.testing.assert_allclose(learned.squared(mirrored(poses))[0], learned.squared(poses)[0], rtol=1e-5)
    np.testing.assert_allclose(
        learned.log_likelihood(mirrored(poses))[0], learned.log_likelihood(poses)[0], rtol=1e-5
    )


def test_codes_and_poses_invert_each_other_and_are_batched(learned: prior.Flow) -> None:
    z = np.random.default_rng(4).standard_normal((2, 5, 48))
    poses = learned.pose(z)
    assert poses.shape == (2, 5, 16, 3)
    np.testing.assert_allclose(learned.code(poses), z, atol=1e-8)
    for i, j in np.ndindex(2, 5):
        np.testing.assert_allclose(learned.code(poses[i, j]), z[i, j], atol=1e-8)
    np.testing.assert_array_equal(
        learned.sample(np.random.default_rng(4), 10), learned.pose(z.reshape(10, 48))
    )


def test_single_precision_is_good_enough_and_signs_of_quaternions_do_not_matter(
    learned: prior.Flow, poses: Array
) -> None:
    poses = poses * np.minimum(1, 2 / np.linalg.norm(poses, axis=-1, keepdims=True))  # none beyond π
    poses[0, 3] = 0.0
    poses[1, 2] = 1e-7
    q = rotations.exp(poses)
    np.testing.assert_allclose(learned.latent(q), learned.code(poses), atol=2e-4)
    np.testing.assert_allclose(learned.latent(-q), learned.latent(q), atol=2e-5)


def test_a_result_does_not_depend_on_its_neighbours(learned: prior.Flow) -> None:
    many = learned.sample(np.random.default_rng(5), 600)
    q = rotations.exp(many)
    np.testing.assert_allclose(learned.latent(q)[::7], learned.latent(q[::7]), atol=1e-4)


def test_the_number_of_threads_changes_no_bit(learned: prior.Flow) -> None:
    many = learned.sample(np.random.default_rng(5), 1500)
    np.testing.assert_array_equal(learned.code(many, threads=3), learned.code(many))
    q = rotations.exp(many)
    np.testing.assert_array_equal(learned.latent(q, threads=2), learned.latent(q))


def test_single_precision_differs_by_1e_5_for_few_samples_and_by_2e_5_for_none(learned: prior.Flow) -> None:
    many = learned.sample(np.random.default_rng(6), 500).astype(np.float32)
    off = np.abs(learned.code(many) - learned.code(many.astype(np.float64))).max(axis=1)  # (500,)
    assert np.quantile(off, 0.99) <= 1e-5
    assert off.max() <= 2e-5


def test_poses_that_nobody_takes_are_unusual(learned: prior.Flow) -> None:
    """A relaxed stance, with a knee and with an elbow bent the wrong way by 20 degrees, and twisted necks."""
    skeleton = bodies.template()
    relaxed = prior.gaussian(skeleton).mean_rad

    def norm(name: str | None = None, turn: tuple[float, float, float] = (0, 0, 0)) -> float:
        pose = relaxed.copy()
        if name is not None:
            i = skeleton.names.index(name)
            bent = rotations.exp(np.radians(turn))
            pose[i - 1] = rotations.log(rotations.multiply(rotations.conjugate(skeleton.rest[i]), bent))
        return float(np.sqrt(learned.squared(pose)[0]))

    usual = norm()
    assert usual < 8
    for name, turn in (
        ("left_knee", (0, -20, 0)),
        ("right_elbow", (0, 0, -20)),
        ("left_elbow", (0, 0, 20)),
        ("head", (0, 0, 100)),
    ):
        assert norm(name, turn) > 1.15 * usual, name


def test_a_damaged_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "prior").mkdir()
    np.savez(tmp_path / "prior" / "flow.npz", schema="simrecon.flow/9")
    monkeypatch.setattr(resources, "folder", lambda _: tmp_path)
    flow.cache_clear()
    try:
        with pytest.raises(
            SimreconError, match=r"flow\.npz: cannot read the pose prior \(schema simrecon\.flow/9"
        ):
            flow()
    finally:
        flow.cache_clear()


def test_the_file_says_where_it_comes_from() -> None:
    path = resources.folder("models") / "prior" / "flow.npz"
    assert path.stat().st_size <= 300_000
    with np.load(path, allow_pickle=False) as data:
        provenance = json.loads(str(data["provenance"]))
    assert "CMU" in provenance["sources"]
    held_out = provenance["log_likelihood"]
    assert held_out["test"] > held_out["test, gaussian"]
    assert provenance["scores"]["turned 30 deg"] >= 0.915
    assert provenance["scores"]["wrong way 20 deg"] >= 0.99
    assert provenance["scores"]["acrobatics over walking"] <= 1.6
    difference = provenance["largest_difference_from_zuko"]
    assert max(difference.values()) <= 1e-5
