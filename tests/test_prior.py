"""The Gaussian pose prior."""

from __future__ import annotations

import numpy as np

from simrecon import body as bodies
from simrecon import prior, rotations
from simrecon.types import Array, Skeleton


def t_pose_rotation(skeleton: Skeleton, mean_rad: Array, name: str) -> Array:
    """The mean as a rotation vector from the T-pose, degrees."""
    i = skeleton.names.index(name)
    turned = rotations.multiply(skeleton.rest[i], rotations.exp(mean_rad[i - 1]))
    return np.degrees(rotations.log(turned))


def test_the_mean_pose_is_usual_and_a_spread_away_is_one() -> None:
    found = prior.gaussian(bodies.template())
    np.testing.assert_allclose(found.latent(rotations.exp(found.mean_rad)), 0.0, atol=1e-12)
    z = found.latent(rotations.exp(found.mean_rad + found.spread_rad))
    np.testing.assert_allclose(z, 1.0, atol=1e-9)


def test_codes_are_batched_over_leading_axes(rng: np.random.Generator) -> None:
    found = prior.gaussian(bodies.template())
    rotvecs = rng.uniform(-0.5, 0.5, (2, 3, 16, 3))
    z = found.latent(rotations.exp(rotvecs))
    assert z.shape == (2, 3, 48)
    expected = (rotvecs - found.mean_rad) / found.spread_rad
    np.testing.assert_allclose(z, expected.reshape(2, 3, 48), atol=1e-9)


def test_the_mean_is_a_relaxed_stance() -> None:
    skeleton = bodies.template()
    mean = prior.gaussian(skeleton).mean_rad
    np.testing.assert_allclose(t_pose_rotation(skeleton, mean, "left_shoulder"), [-75, 0, -15], atol=1e-9)
    np.testing.assert_allclose(t_pose_rotation(skeleton, mean, "right_shoulder"), [75, 0, 15], atol=1e-9)
    np.testing.assert_allclose(t_pose_rotation(skeleton, mean, "right_knee"), [0, 15, 0], atol=1e-9)


def test_the_mean_is_within_the_limits_and_spreads_follow_the_ranges() -> None:
    skeleton = bodies.template()
    found = prior.gaussian(skeleton)
    low, high = skeleton.limits_rad[..., 0], skeleton.limits_rad[..., 1]
    assert ((low < found.mean_rad) & (found.mean_rad < high)).all()
    np.testing.assert_allclose(found.spread_rad, 0.25 * (high - low))
