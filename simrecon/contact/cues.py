"""What evidence shows of a person, as contact labels are made of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.body import names
from simrecon.geometry import camera as cameras
from simrecon.types import Array, Camera, IntArray

DISTANCE_M = 4.0
"""From the camera to the person, where nothing tells it."""


@dataclass(frozen=True, eq=False)
class Cues:
    """M points of the body (`body.names.points`), T frames.

    Attributes:
        interval_s: between frames.
        camera: with a path, or None.
        rays: (M, T, 2) undistorted detections x/z, y/z; scores: (M, T), zero where not seen.
        joints_m: (M, T, 3) a 3D estimate on world axes; known: (M, T), zero where it is not.
        in_world: whether the estimate is at its place in the world, too.
    """

    interval_s: float
    camera: Camera | None
    rays: Array
    scores: Array
    joints_m: Array
    known: Array
    in_world: bool

    def places(self, points: tuple[str, ...]) -> tuple[Array, Array]:
        """Places (P, T, n) m of some points, whose speed tells what rests, and how surely each is known.

        They are those in the image, at one distance from the camera, else those of the 3D estimate.
        """
        rows = rows_of(points)
        if self.camera is not None and self.scores[rows].any():
            world = self.joints_m if self.in_world else None
            return _at_a_distance(self.camera, self.rays[rows], world), self.scores[rows]
        return self.joints_m[rows], self.known[rows]


def rows_of(points: tuple[str, ...]) -> IntArray:
    """Rows of points of the body by name."""
    return names.resolve(points)


def _at_a_distance(camera: Camera, rays: Array, in_world_m: Array | None) -> Array:
    """Places of detections at one distance from the camera for the whole clip, whose speed tells what rests.

    Args:
        camera: with a path.
        rays: (M, T, 2) undistorted detections x/z, y/z.
        in_world_m: (M', T, 3) of a 3D estimate in the world, whose median gives the distance; None: it is
            assumed.

    Returns:
        (M, T, 2) in the image of a camera that stands still, (M, T, 3) in the world of one that moves.
    """
    if cameras.is_still(camera):
        return rays * DISTANCE_M
    distance = DISTANCE_M
    if in_world_m is not None:
        distance = float(np.median(np.linalg.norm(in_world_m - cameras.centre_m(camera), axis=-1)))
    ahead = np.concatenate((rays, np.ones((*rays.shape[:2], 1))), axis=-1)  # (M, T, 3)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    return cameras.to_world(camera, distance * ahead)
