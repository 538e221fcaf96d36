"""Pose priors: how unusual a pose is, as the length of a latent code z(q) (Gärtner 2022 eq. 4).

`gaussian` needs no training data; `flow` is learned from motion capture (docs/decisions/0008).
"""

from __future__ import annotations

from typing import Protocol

from simrecon.errors import InputError
from simrecon.plan import PRIORS
from simrecon.prior.flow import Flow
from simrecon.prior.flow_file import flow
from simrecon.prior.gaussian import Gaussian, gaussian
from simrecon.types import Array, Skeleton

__all__ = ["Flow", "Gaussian", "Prior", "flow", "gaussian", "make"]


class Prior(Protocol):
    """Maps poses to latent codes whose length says how unusual they are."""

    def latent(self, joints: Array) -> Array:
        """Latent codes (..., 48) of joint quaternions (..., 16, 4) as they stand in `qpos`."""

    def slope(self, rotvecs: Array) -> Array:
        """Derivative (..., 48, 16, 3) of the codes of rotation vectors (..., 16, 3) with respect to them."""

    def squared(self, rotvecs: Array) -> tuple[Array, Array]:
        """‖z‖² (...) of rotation vectors (..., 16, 3) and its gradient, (..., 16, 3)."""


def make(model: str, skeleton: Skeleton) -> Prior:
    """The prior of a name in `plan.PRIORS`, for the poses of a skeleton.

    Raises:
        InputError: there is no prior of that name.
    """
    if model == "gaussian":
        return gaussian(skeleton)
    if model == "flow":
        return flow()
    raise InputError(f"prior: found {model!r}; valid: {', '.join(PRIORS)}")
