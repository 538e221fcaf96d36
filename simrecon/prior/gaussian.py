"""A Gaussian pose prior, joint by joint (`models/prior/gaussian.toml`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon import resources
from simrecon.geometry import rotations
from simrecon.types import Array, Skeleton


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Independent normal distributions of the components of the joints' rotation vectors.

    Attributes:
        mean_rad: (16, 3) about the centre of each joint's range.
        spread_rad: (16, 3) standard deviations.
    """

    mean_rad: Array
    spread_rad: Array

    def latent(self, joints: Array) -> Array:
        """Standard scores (..., 48) of joint quaternions (..., 16, 4)."""
        z = (rotations.log(joints) - self.mean_rad) / self.spread_rad
        return z.reshape(*joints.shape[:-2], -1)

    def slope(self, rotvecs: Array) -> Array:
        """Derivative (..., 48, 16, 3) of the scores of rotation vectors (..., 16, 3): one over the spread."""
        slope = np.diag(1 / self.spread_rad.ravel()).reshape(-1, *self.spread_rad.shape)
        return np.broadcast_to(slope, (*rotvecs.shape[:-2], *slope.shape))

    def squared(self, rotvecs: Array) -> tuple[Array, Array]:
        """‖z‖² (...) of rotation vectors (..., 16, 3) and its gradient, (..., 16, 3)."""
        z = (rotvecs - self.mean_rad) / self.spread_rad
        return np.sum(z**2, axis=(-2, -1)), 2 * z / self.spread_rad


def gaussian(skeleton: Skeleton) -> Gaussian:
    """The prior of `models/prior/gaussian.toml` for a skeleton's rest orientations and limits."""
    data = resources.toml("models", "prior", "gaussian.toml")
    means = []
    for name in skeleton.names[1:]:
        side = np.array([-1.0, 1.0, -1.0]) if name.startswith("right_") else np.ones(3)
        means.append(side * np.radians(data["mean_deg"][name.replace("right_", "left_", 1)]))
    relative = rotations.multiply(rotations.conjugate(skeleton.rest[1:]), rotations.exp(np.array(means)))
    spread = data["spread"] * (skeleton.limits_rad[..., 1] - skeleton.limits_rad[..., 0])
    return Gaussian(rotations.log(relative), spread)
