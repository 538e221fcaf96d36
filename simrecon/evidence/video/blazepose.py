"""The mathematics of BlazePose (Bazarevsky et al. 2020): regions of people, and landmarks from a tensor.

Pixels: x right, y down, (0, 0) at the corner of the image. Constants are those of the published graphs
(`pose_detection`, `pose_landmark`; MediaPipe 0.10.21).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array

Image = NDArray[np.uint8]

NAMES = (
    "nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye",
    "right_eye_outer", "left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder",
    "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_pinky",
    "right_pinky", "left_index", "right_index", "left_thumb", "right_thumb", "left_hip", "right_hip",
    "left_knee", "right_knee", "left_ankle", "right_ankle", "left_heel", "right_heel",
    "left_foot_index", "right_foot_index",
)  # fmt: skip
COUNT = len(NAMES)

SCORE_CLIP = 100.0
LANDMARK_SIDE = 256
RAW_COUNT, RAW_VALUES = 39, 5
HEATMAP_SIDE, HEATMAP_REACH, HEATMAP_MIN = 64, 3, 0.5
REGION_SCALE = 1.25


@dataclass(frozen=True)
class Region:
    """A square part of the image, turned so that the person is upright in it.

    Attributes:
        centre_px: (2,).
        side_px: of the square.
        angle_rad: by which the person is turned clockwise in the image.
    """

    centre_px: Array
    side_px: float
    angle_rad: float

    def matrix(self, side: int) -> Array:
        """(2, 3) affine transform from a crop of `side` pixels to the image."""
        scale = self.side_px / side
        cos, sin = scale * np.cos(self.angle_rad), scale * np.sin(self.angle_rad)
        turn = np.array([[cos, -sin], [sin, cos]])
        return np.concatenate((turn, (self.centre_px - turn @ np.full(2, side / 2))[:, None]), axis=1)


@dataclass(frozen=True)
class Pose:
    """Landmarks of one person in one image.

    Attributes:
        points_px: (33, 2).
        scores: (33,) visibility × presence, in [0, 1].
        world_m: (33, 3) around the middle of the hips, axes of the camera.
        presence: that there is a person, in [0, 1].
        region: where to look for the person in the next image.
    """

    points_px: Array
    scores: Array
    world_m: Array
    presence: float
    region: Region


def sigmoid(values: Array) -> Array:
    """1 / (1 + exp(-x)) of values clipped to ±100."""
    result: Array = 1.0 / (1.0 + np.exp(-np.clip(values, -SCORE_CLIP, SCORE_CLIP)))
    return result


def align(centre: Array, edge: Array) -> Region:
    """The region around `centre` (2,) whose point `edge` (2,) is straight above it at the person's reach."""
    x, y = edge - centre
    angle = np.pi / 2 - np.arctan2(-y, x)
    angle -= 2 * np.pi * np.floor((angle + np.pi) / (2 * np.pi))
    return Region(np.asarray(centre, float), float(2 * np.hypot(x, y) * REGION_SCALE), float(angle))


def crop(image: Image, region: Region, side: int = LANDMARK_SIDE) -> Image:
    """The region as a square image (side, side, 3), black beyond the image's edge."""
    matrix = region.matrix(side)
    matrix[:, 2] += matrix[:, :2] @ np.full(2, 0.5) - 0.5  # OpenCV counts from the centre of the first pixel
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    square = cv2.warpAffine(image, matrix, (side, side), flags=flags, borderMode=cv2.BORDER_CONSTANT)
    return square.astype(np.uint8, copy=False)


def refine(points: Array, heatmap: Array) -> Array:
    """Points moved to the centre of mass of their heat around them, where it is hot enough.

    Args:
        points: (M, 2) in [0, 1] of the crop.
        heatmap: (64, 64, M) before the sigmoid.

    Returns:
        (M, 2).
    """
    side = heatmap.shape[0]
    result = points.copy()
    cells = np.floor(points * side).astype(int)  # (M, 2)
    for m in np.flatnonzero(((cells >= 0) & (cells < side)).all(axis=1)):
        low = np.maximum(cells[m] - HEATMAP_REACH, 0)
        high = np.minimum(cells[m] + HEATMAP_REACH + 1, side)
        heat = sigmoid(heatmap[low[1] : high[1], low[0] : high[0], m].astype(float))  # (rows, columns)
        total = heat.sum()
        if heat.max() >= HEATMAP_MIN and total > 0:
            x = heat.sum(axis=0) @ np.arange(low[0], high[0]) / total
            y = heat.sum(axis=1) @ np.arange(low[1], high[1]) / total
            result[m] = np.array([x, y]) / side
    return result


def decode_pose(raw: Array, presence: float, heatmap: Array | None, world: Array, region: Region) -> Pose:
    """The landmark network's tensors as a pose in the image.

    Args:
        raw: (39, 5) x, y, z in pixels of the crop; visibility and presence before the sigmoid.
        presence: of a person in the crop, in [0, 1].
        heatmap: (64, 64, 39), or None for no refinement.
        world: (39, 3), metres, upright as in the crop.
        region: that was cropped.
    """
    flat = raw[:, :2] / LANDMARK_SIDE
    if heatmap is not None:
        flat = refine(flat, heatmap)
    matrix = region.matrix(1)
    points = flat @ matrix[:, :2].T + matrix[:, 2]  # (39, 2)
    cos, sin = np.cos(region.angle_rad), np.sin(region.angle_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Pose(
        points_px=points[:COUNT],
        scores=(sigmoid(raw[:, 3]) * sigmoid(raw[:, 4]))[:COUNT],
        world_m=world[:COUNT] @ turn.T,
        presence=presence,
        region=align(points[COUNT], points[COUNT + 1]),
    )
