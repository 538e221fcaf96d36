"""From where a picture is taken: a crop of the camera's image, or a camera that is made up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.geometry import camera as cameras
from simrecon.geometry import vectors
from simrecon.types import Array, Camera, Evidence, Lens


@dataclass(frozen=True, eq=False)
class View:
    """A crop of the camera's image, scaled; `size` = width and height of the output.

    Attributes:
        origin_px: (2,) upper left corner of the crop; 0 is the edge of the first pixel.
        scale: (2,) output pixels per pixel.
    """

    origin_px: Array
    scale: Array
    size: tuple[int, int]

    def pixels(self, image_px: Array) -> Array:
        """Pixels of the camera's image (..., 2) → pixels of the output; whole numbers are pixel centres."""
        return (image_px + 0.5 - self.origin_px) * self.scale - 0.5


def has_view(camera: Camera | None) -> bool:
    """Whether it is known where the camera stands."""
    return camera is not None and camera.path is not None


def is_placed(evidence: Evidence) -> bool:
    """Whether anything says where the camera stands: a path, landmarks in its image, or joints before it."""
    return evidence.camera is not None and (
        evidence.camera.path is not None or bool(evidence.keypoint_names) or evidence.joints_frame != "world"
    )


def three_quarter(
    low_m: Array, high_m: Array, facing_rad: float, elevation_rad: float = np.deg2rad(15)
) -> Camera:
    """A camera of one frame, 40° beside `facing_rad` and a little above, that sees the whole box."""
    azimuth, elevation = facing_rad + np.deg2rad(40), elevation_rad
    towards = np.array(
        [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
    )
    right = vectors.unit(np.cross([0.0, 0.0, 1.0], towards))
    rotation = np.stack((right, np.cross(right, towards), -towards))  # rows: x right, y down, z forward
    corners = np.stack(np.meshgrid(*zip(low_m, high_m, strict=True)), axis=-1).reshape(8, 3)
    middle = (low_m + high_m) / 2
    local = (corners - middle) @ rotation.T  # (8, 3)
    width, height, focal = 960, 720, 1500.0
    tangent = 0.9 * np.array([width, height]) / 2 / focal
    distance = float((np.abs(local[:, :2]) / tangent - local[:, 2:]).max())
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ (middle + towards * distance)
    matrix = np.array([[focal, 0, width / 2 - 0.5], [0, focal, height / 2 - 0.5], [0, 0, 1]])
    return cameras.still(Lens(matrix, np.zeros(5), (width, height)), transform)


def corner_radius(camera: Camera) -> float:
    """Largest distance of the image's corners from the optical axis, in ideal image-plane coordinates."""
    width, height = camera.lens.image_size_px
    corners = np.array([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]])
    return float(np.linalg.norm(cameras.undistort(camera.lens, corners), axis=-1).max())
