"""A floor through contacts, by Huber regression (Rempe 2020, B.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.types import Array, Flags

ROUNDS = 50
"""Of the regression, each a weighted least squares."""
SCALE = 1.4826
"""Standard deviation over median of absolute errors, of the normal distribution."""
LEAST_M = 1e-3
"""Of the standard deviation."""


@dataclass(frozen=True, eq=False)
class Floor:
    """A plane n · x = d.

    Attributes:
        normal: (3,) unit, upwards; height_m: d.
    """

    normal: Array
    height_m: float

    def over_m(self, points_m: Array) -> Array:
        """Height (...) of points (..., 3) over it."""
        return np.asarray(points_m @ self.normal - self.height_m)


def huber(points_m: Array, huber_: float) -> Floor:
    """The plane z = a x + b y + c that points (N, 3) are nearest to; level through fewer than three.

    Args:
        points_m: of contacts.
        huber_: errors beyond that many standard deviations (of the median) count linearly.
    """
    if len(points_m) < 3:
        return Floor(np.array([0.0, 0.0, 1.0]), float(points_m[:, 2].mean()) if len(points_m) else 0.0)
    middle = points_m.mean(axis=0)
    across = np.column_stack((points_m[:, :2] - middle[:2], np.ones(len(points_m))))  # (N, 3)
    weight, found = np.ones(len(points_m)), np.zeros(3)
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        found = np.linalg.lstsq(root[:, None] * across, root * points_m[:, 2], rcond=1e-6)[0]
        error = np.abs(points_m[:, 2] - across @ found)
        limit = huber_ * max(SCALE * float(np.median(error)), LEAST_M)
        weight = np.minimum(1.0, limit / np.maximum(error, 1e-12))
    normal = np.array([-found[0], -found[1], 1.0]) / np.hypot(1.0, np.hypot(found[0], found[1]))
    return Floor(normal, float(normal @ (middle * [1.0, 1.0, 0.0] + [0.0, 0.0, found[2]])))


def through(places_m: Array, contact: Flags, huber_: float, outlier_m: float) -> tuple[Floor, Flags]:
    """The floor of the contacts of P points, and these contacts without the outliers.

    Args:
        places_m: (P, T, 3).
        contact: (P, T).
        huber_: as above.
        outlier_m: farther from the floor is no contact.
    """
    floor = huber(places_m[contact], huber_)
    return floor, contact & (np.abs(floor.over_m(places_m)) <= outlier_m)
