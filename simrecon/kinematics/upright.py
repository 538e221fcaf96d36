"""Which way is up, of a camera that nobody knows: as people stand, so that they don't fall.

Whoever stands has the centre of mass over the feet, on average over some time, however they lean. So the
mean direction from the supporting feet to the centre of mass is up, in the frames in which the person stands
erect; a sitting or crouching person leans where they like. The world of a 3D estimate knows it too, and so
do cameras, which are held level. Mostly both are off by some degrees, but then by twenty: they are taken for
Student t-distributed (Lange, Little and Taylor 1989), so that one which is far from the others counts little.
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
WORLD_RAD = 0.06
"""Scale of the lean of a network's world, about each axis."""
ROLL_RAD, PITCH_RAD = 0.06, 0.18
"""Scales of how a camera is held: about the view, and about the image's x axis."""
FREEDOM = 3.0
"""Degrees of freedom of the two."""
ROUNDS = 30
"""Of weighing what is known anew, enough for a hundredth of a degree."""
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


@dataclass(frozen=True, eq=False)
class Belief:
    """What something says of up.

    Attributes:
        direction: (3,) unit vector.
        precision: (3, 3) inverse covariance of its error.
        freedom: degrees of freedom of a t-distribution; infinite: a normal one.
    """

    direction: Array
    precision: Array
    freedom: float = np.inf

    def weight(self, up: Array) -> float:
        """On its precision if that is up, as in the maximisation of a t-distribution's likelihood."""
        if np.isinf(self.freedom):
            return 1.0
        off = up - self.direction
        return float((self.freedom + 2) / (self.freedom + off @ self.precision @ off))


def find(state: State, *, world: bool) -> Upright:
    """Up, of a fit whose world is about upright.

    Args:
        state: of the fit.
        world: whether the 3D estimate is in a world of its own, else in the camera's frame.
    """
    beliefs = [] if (balance := _balance(state)) is None else [balance]
    camera = state.problem.observations.world_to_camera
    if world or camera is None:
        beliefs.append(Belief(np.array([0.0, 0.0, 1.0]), np.eye(3) / WORLD_RAD**2, FREEDOM))
    if camera is not None:
        axes = camera[0, :3, :3]
        precision = axes.T @ np.diag(np.array([ROLL_RAD, PITCH_RAD, PITCH_RAD]) ** -2.0) @ axes
        beliefs.append(Belief(-axes[1], precision, FREEDOM))
    return agreed(beliefs)


def agreed(beliefs: list[Belief]) -> Upright:
    """The direction that is most probable by all of them; the search begins at the first."""
    up, precision = beliefs[0].direction, np.eye(3)
    for _ in range(ROUNDS):
        weighed = [one.weight(up) * one.precision for one in beliefs]
        precision = np.sum(weighed, axis=0)
        pull = sum(matrix @ one.direction for matrix, one in zip(weighed, beliefs, strict=True))
        up = np.linalg.solve(precision, pull)
        up /= np.linalg.norm(up)
    covariance = np.linalg.inv(precision)
    return Upright(up, float(np.sqrt(np.trace(covariance) - up @ covariance @ up)))


def _balance(state: State) -> Belief | None:
    """Where the centre of mass is over the feet; None where nobody stands for long enough."""
    standing = state.problem.observations.standing  # (2, T)
    weights = np.where(standing > STANDS, standing, 0.0)
    total = weights.sum(axis=0)  # (T,)
    support = np.einsum("st,stc->tc", weights, state.soles_m) / np.maximum(total, 1e-9)[:, None]
    rise = state.com_m - support  # (T, 3)
    high = np.linalg.norm(rise, axis=1)
    erect = (total > 0) & (high > ERECT * state.scale * bodies.stature_m(state.problem.skeleton))
    seconds = float(erect.sum()) * state.dt
    if seconds < FEWEST_S:
        return None
    units = rise[erect] / high[erect, None]
    mean = units.mean(axis=0)
    mean /= np.linalg.norm(mean)
    spread = max(float(np.sqrt(np.mean(np.sum((units - mean) ** 2, axis=1)))), SPREAD_LEAST_RAD)
    sigma = float(np.hypot(SYSTEMATIC_RAD, spread / np.sqrt(max(1.0, SWAYS_PER_S * seconds))))
    return Belief(mean, np.eye(3) * 2 / sigma**2)
