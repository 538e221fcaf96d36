"""Which way is up, of a camera that nobody knows: as people stand, so that they don't fall.

Whoever stands has the centre of mass over the feet, on average over some time, however they lean. So the
mean direction from the supporting feet to the centre of mass is up, in the frames in which the person stands
erect; a sitting or crouching person leans where they like. Cameras that are held level know it too, with an
error of some degrees to tens of degrees; both are weighed by their deviations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon import body as bodies
from simrecon.geometry import rotations
from simrecon.kinematics.state import State
from simrecon.types import Array

ERECT = 0.42
"""Least distance of the centre of mass from the supporting feet, in statures: 0.55 standing, 0.4 sitting."""
STANDS = 0.5
"""How surely a foot stands that counts as a support."""
SWAYS_PER_S = 8.0
"""Independent directions in a second of standing or walking: a step takes half of one."""
SPREAD_LEAST_RAD = 0.15
"""Of one direction: who leans for a short time leans alike in all of its frames."""
SYSTEMATIC_RAD = 0.04
"""What remains of the error of the mean: the 3D estimate's depth, and who leans against something."""
LEVEL_RAD = {"world": 0.12, "camera": 0.25}
"""Deviation of what counts as up before: a network's world leans by 4 to 8 degrees, a camera looks down."""
FEWEST_S = 0.15
"""Of standing, without which nothing is said."""
SURE_RAD = 0.12
"""Up to here the direction is better known than by a plane under the feet, whose path is often a line."""


@dataclass(frozen=True, eq=False)
class Upright:
    """Up, in the world of a fit.

    Attributes:
        direction: (3,) unit vector.
        sigma_rad: its deviation.
    """

    direction: Array
    sigma_rad: float

    @property
    def turn(self) -> Array:
        """The least rotation (3, 3) that brings it to z."""
        x, y, z = self.direction
        axis = np.array([y, -x, 0.0])
        sine = float(np.linalg.norm(axis))
        rotvec = axis / max(sine, 1e-12) * np.arctan2(sine, z)
        return rotations.matrix(rotations.exp(rotvec))


def find(state: State, *, world: bool) -> Upright:
    """Up, of a fit whose world is about upright.

    Args:
        state: of the fit.
        world: whether the 3D estimate is in a world of its own, else in the camera's frame.
    """
    level = LEVEL_RAD["world" if world else "camera"]
    standing = state.problem.observations.standing  # (2, T)
    weights = np.where(standing > STANDS, standing, 0.0)
    total = weights.sum(axis=0)  # (T,)
    support = np.einsum("st,stc->tc", weights, state.soles_m) / np.maximum(total, 1e-9)[:, None]
    rise = state.com_m - support  # (T, 3)
    high = np.linalg.norm(rise, axis=1)
    erect = (total > 0) & (high > ERECT * state.scale * bodies.stature_m(state.problem.skeleton))
    seconds = float(erect.sum()) * state.dt
    if seconds < FEWEST_S:
        return Upright(np.array([0.0, 0.0, 1.0]), level)
    units = rise[erect] / high[erect, None]
    mean = units.mean(axis=0)
    mean /= np.linalg.norm(mean)
    spread = max(float(np.sqrt(np.mean(np.sum((units - mean) ** 2, axis=1)))), SPREAD_LEAST_RAD)
    sigma = float(np.hypot(SYSTEMATIC_RAD, spread / np.sqrt(max(1.0, SWAYS_PER_S * seconds))))
    both = mean / sigma**2 + np.array([0.0, 0.0, 1.0]) / level**2
    return Upright(both / np.linalg.norm(both), float((sigma**-2 + level**-2) ** -0.5))
