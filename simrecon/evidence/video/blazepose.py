"""The mathematics of BlazePose (Bazarevsky et al. 2020): tensors of its two networks to people and landmarks.

Pixels: x right, y down, (0, 0) at the corner of the image. Constants are those of the published graphs
(`pose_detection`, `pose_landmark`; MediaPipe 0.10.21). A: anchors of the detector, C: candidates.
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

DETECTOR_SIDE = 224
STRIDES = (8, 16, 32, 32, 32)
ANCHORS_PER_CELL = 2
SCORE_CLIP = 100.0
CANDIDATE_SCORE_MIN = 0.5
SUPPRESSION_IOU = 0.3

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
class Candidate:
    """A person that the detector sees: score in [0, 1], box x0 y0 x1 y1 of the face, region of the body."""

    score: float
    box_px: Array
    region: Region


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


def anchors(side: int = DETECTOR_SIDE) -> Array:
    """Centres of the detector's anchors, (A, 2) in [0, 1], row by row.

    Layers of one stride share their cells; each brings two anchors (of sizes that the network does not use).
    """
    parts = []
    for stride in sorted(set(STRIDES)):
        cells = -(-side // stride)
        line = (np.arange(cells) + 0.5) / cells
        y, x = np.meshgrid(line, line, indexing="ij")  # (cells, cells)
        each = np.stack((x, y), axis=-1).reshape(-1, 2)
        parts.append(np.repeat(each, ANCHORS_PER_CELL * STRIDES.count(stride), axis=0))
    return np.concatenate(parts)


def sigmoid(values: Array) -> Array:
    """1 / (1 + exp(-x)) of values clipped to ±100."""
    result: Array = 1.0 / (1.0 + np.exp(-np.clip(values, -SCORE_CLIP, SCORE_CLIP)))
    return result


def decode_candidates(
    raw: Array, scores: Array, centres: Array, minimum: float = CANDIDATE_SCORE_MIN
) -> Array:
    """The detector's tensors to candidates above a score, best first.

    Args:
        raw: (A, 12): box centre and size, then four points, in pixels of its input, relative to the anchor.
        scores: (A,) before the sigmoid.
        centres: (A, 2) of the anchors.
        minimum: score.

    Returns:
        (C, 13) in [0, 1] of the network's input: x0 y0 x1 y1, four points, score.
    """
    chance = sigmoid(scores)
    keep = np.flatnonzero(chance >= minimum)
    keep = keep[np.argsort(-chance[keep], kind="stable")]
    values = raw[keep] / DETECTOR_SIDE
    centre = values[:, :2] + centres[keep]  # (C, 2)
    half = values[:, 2:4] / 2
    points = values[:, 4:].reshape(-1, 4, 2) + centres[keep][:, None]  # (C, 4, 2)
    return np.concatenate((centre - half, centre + half, points.reshape(-1, 8), chance[keep, None]), axis=1)


def iou(box: Array, boxes: Array) -> Array:
    """Intersection over union of one box (4,) with boxes (C, 4), (C,)."""
    low = np.maximum(box[:2], boxes[:, :2])
    high = np.minimum(box[2:], boxes[:, 2:])
    shared = np.prod(np.maximum(high - low, 0.0), axis=1)
    area = np.prod(np.maximum(boxes[:, 2:] - boxes[:, :2], 0.0), axis=1)
    total = shared / np.maximum(np.prod(box[2:] - box[:2]) + area - shared, 1e-12)
    return np.asarray(total)


def suppress(candidates: Array, overlap: float = SUPPRESSION_IOU) -> Array:
    """Weighted non-maximum suppression.

    Args:
        candidates: (C, 13), best first.
        overlap: candidates whose boxes overlap the best one's by more are the same person.

    Returns:
        One candidate per person: the mean of its candidates, weighted by score, with the best score.
    """
    left, kept = candidates, []
    while len(left):
        same = iou(left[0, :4], left[:, :4]) > overlap
        same[0] = True
        group = left[same]
        mean = group[:, -1] @ group[:, :-1] / group[:, -1].sum()
        kept.append(np.append(mean, group[0, -1]))
        left = left[~same]
    return np.array(kept).reshape(-1, candidates.shape[1])


def letterbox(width: float, height: float, side: int) -> tuple[float, Array]:
    """Pixels of the image per pixel of a square input, and the bars (2,) left and above, in the input's."""
    scale = max(width, height) / side
    return scale, (side - np.array([width, height]) / scale) / 2


def align(centre: Array, edge: Array) -> Region:
    """The region around `centre` (2,) whose point `edge` (2,) is straight above it at the person's reach."""
    x, y = edge - centre
    angle = np.pi / 2 - np.arctan2(-y, x)
    angle -= 2 * np.pi * np.floor((angle + np.pi) / (2 * np.pi))
    return Region(np.asarray(centre, float), float(2 * np.hypot(x, y) * REGION_SCALE), float(angle))


def to_candidates(rows: Array, tile: tuple[float, float, float, float]) -> list[Candidate]:
    """Candidates in the image, of those in the network's input, which is a letterboxed tile.

    Args:
        rows: (C, 13) after suppression.
        tile: x, y, width, height in the image.
    """
    scale, bars = letterbox(tile[2], tile[3], DETECTOR_SIDE)
    result = []
    for row in rows:
        points = (row[:12].reshape(6, 2) * DETECTOR_SIDE - bars) * scale + tile[:2]
        result.append(Candidate(float(row[12]), points[:2].reshape(4), align(points[2], points[3])))
    return result


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
