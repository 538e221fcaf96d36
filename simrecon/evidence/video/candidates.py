"""The detector of BlazePose (Bazarevsky et al. 2020): its tensors to people that may be in the image.

Pixels and the source of constants are as in `blazepose`. A: anchors, C: candidates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.evidence.video.blazepose import Region, align, sigmoid
from simrecon.types import Array

DETECTOR_SIDE = 224
STRIDES = (8, 16, 32, 32, 32)
ANCHORS_PER_CELL = 2
CANDIDATE_SCORE_MIN = 0.5
SUPPRESSION_IOU = 0.3


@dataclass(frozen=True)
class Candidate:
    """A person that the detector sees: score in [0, 1], box x0 y0 x1 y1 of the face, region of the body."""

    score: float
    box_px: Array
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
