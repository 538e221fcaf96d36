"""What tells one person in an image from another: place, size, colours; and whether it is a person at all."""

from __future__ import annotations

import cv2
import numpy as np

from simrecon.evidence.video.blazepose import NAMES, Image, Pose, Region
from simrecon.types import Array

# In sides of the region, about 1.3 times the person's height.
SAME_PERSON_MAX = 0.25  # two poses this near are one person's
SIZE_RATIO_MAX = 1.4
COLOUR_BINS = (12, 4, 4)  # hue, saturation, value
TRUNK = tuple(NAMES.index(name) for name in ("left_shoulder", "right_shoulder", "right_hip", "left_hip"))
BODY = tuple(range(NAMES.index("left_shoulder"), len(NAMES)))
"""All but the face."""
PRESENCE_MIN = 0.5
CLARITY_MIN = 0.3
"""Mean score of the body's landmarks: who is seen whole comes to 0.7 and more, who is half hidden to 0.4."""
MISFIT_MAX = 0.12
"""Of the person's size, distance of the landmarks in the image from the 3D estimate as seen from far away:
the network makes both of one person, and they are apart where there is none. People come to 0.03 to 0.05."""


def middle(pose: Pose) -> Array:
    """Middle of the trunk, (2,) px."""
    return np.asarray(pose.points_px[list(TRUNK)].mean(axis=0))


def bounds(pose: Pose) -> Array:
    """x0 y0 x1 y1 of the landmarks that are seen."""
    points = pose.points_px[pose.scores >= 0.3] if (pose.scores >= 0.3).any() else pose.points_px
    return np.concatenate((points.min(axis=0), points.max(axis=0)))


def size_px(pose: Pose) -> float:
    """Longer side of the box of the landmarks that are seen."""
    left, top, right, bottom = bounds(pose)
    return float(max(right - left, bottom - top))


def clarity(pose: Pose) -> float:
    """Mean score of the body's landmarks."""
    return float(pose.scores[list(BODY)].mean())


def misfit(pose: Pose) -> float:
    """Distance (root mean square) of the landmarks from the 3D estimate, scaled and shifted, in sizes."""
    flat, solid = pose.points_px[list(BODY)], pose.world_m[list(BODY), :2]
    flat, solid = flat - flat.mean(axis=0), solid - solid.mean(axis=0)
    scale = float((flat * solid).sum()) / max(float((solid**2).sum()), 1e-12)
    off = np.linalg.norm(flat - scale * solid, axis=1)
    return float(np.sqrt((off**2).mean())) / max(size_px(pose), 1e-6)


def is_person(pose: Pose) -> bool:
    """Whether a pose can be somebody's: seen, clearly enough, and of one mind with its 3D estimate."""
    return pose.presence >= PRESENCE_MIN and clarity(pose) >= CLARITY_MIN and misfit(pose) <= MISFIT_MAX


def same(a: Region, b: Region) -> bool:
    """Whether two regions are one person's."""
    apart = float(np.linalg.norm(a.centre_px - b.centre_px))
    ratio = max(a.side_px, b.side_px) / max(min(a.side_px, b.side_px), 1e-6)
    return apart <= SAME_PERSON_MAX * min(a.side_px, b.side_px) and ratio <= SIZE_RATIO_MAX**2


def alike(a: Region, b: Region) -> bool:
    """Whether two regions at one place have about the same size."""
    return max(a.side_px, b.side_px) <= SIZE_RATIO_MAX * max(min(a.side_px, b.side_px), 1e-6)


def colours(image: Image, pose: Pose) -> Array | None:
    """Histogram of the trunk's colours, sum 1; None if too little of it is in the image."""
    corners = pose.points_px[list(TRUNK)]
    low = np.maximum(np.floor(corners.min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(corners.max(axis=0)), [image.shape[1], image.shape[0]]).astype(int)
    if (high - low < 4).any():
        return None
    step = max(int((high - low).max()) // 64, 1)
    part = np.ascontiguousarray(image[low[1] : high[1] : step, low[0] : high[0] : step])
    mask = np.zeros(part.shape[:2], np.uint8)
    cv2.fillConvexPoly(mask, np.rint((corners - low) / step).astype(np.int32), 255)
    if np.count_nonzero(mask) < 20:
        return None
    hsv = cv2.cvtColor(part, cv2.COLOR_BGR2HSV)
    counts = cv2.calcHist([hsv], [0, 1, 2], mask, list(COLOUR_BINS), [0, 180, 0, 256, 0, 256])
    share: Array = np.asarray(counts, float).ravel()
    return np.asarray(share / share.sum())


def colour_distance(a: Array | None, b: Array | None) -> float:
    """Bhattacharyya distance √(1 − Σ√(ab)) of two histograms; 0 where one is unknown."""
    if a is None or b is None:
        return 0.0
    return float(np.sqrt(max(1.0 - np.sqrt(a * b).sum(), 0.0)))
