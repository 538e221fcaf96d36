"""Pose priors: how unusual a pose is, as the length of a latent code z(q) (Gärtner 2022 eq. 4).

A prior is anything with `latent(joints)`. The Gaussian here is the first one; it needs no training data.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simrecon import resources, rotations
from simrecon.types import Array, Skeleton


class Prior(Protocol):
    """Maps poses to latent codes whose length says how unusual they are."""

    def latent(self, joints: Array) -> Array:
        """Latent codes (..., D) of joint quaternions (..., 16, 4) as they stand in `qpos`."""


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
