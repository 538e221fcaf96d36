"""A camera that pans and is carried sideways, from one that stands still."""

from __future__ import annotations

import numpy as np

from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.types import Camera


def panning(camera: Camera, frames: int, pan_rad: float = 0.45, move_m: float = 0.5) -> Camera:
    """The camera turned about the vertical and moved to its right, in the middle of the clip as it was."""
    share = np.linspace(-0.5, 0.5, frames)
    turn = rotations.matrix(rotations.exp(np.outer(-pan_rad * share, [0.0, 0.0, 1.0])))  # (T, 3, 3)
    first = cameras.extrinsics(camera)[0, :3, :3]
    centre = cameras.centre_m(camera)[0] + move_m * share[:, None] * first[0]
    path = np.tile(np.eye(4), (frames, 1, 1))
    path[:, :3, :3] = first @ turn
    path[:, :3, 3] = -(path[:, :3, :3] @ centre[..., None])[..., 0]
    return cameras.with_path(camera, path)
