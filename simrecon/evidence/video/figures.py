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
COLOUR_SIDE = 96
"""Of the small image of trunk and thighs whose colours are counted."""
LINE_WIDTH = 0.05
TRUNK = tuple(NAMES.index(name) for name in ("left_shoulder", "right_shoulder", "right_hip", "left_hip"))
LINES = tuple(
    (NAMES.index(begin), NAMES.index(end))
    for begin, end in (
        ("left_shoulder", "right_shoulder"), ("left_shoulder", "left_hip"), ("right_shoulder", "right_hip"),
        ("left_shoulder", "right_hip"), ("right_shoulder", "left_hip"),
        ("left_hip", "left_knee"), ("right_hip", "right_knee"),
    )
)  # fmt: skip
CLOTHED = tuple(sorted({joint for line in LINES for joint in line}))
"""Ends of the lines along which colours are counted."""
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
    """Histogram of the colours of trunk and thighs, sum 1; None if too little of them is in the image.

    Along lines and not within an outline, which holds the background of who is seen from the side, and legs
    and hair of who is tucked. Half of each pixel goes to the bins around its own, so that shade and blur
    change little.
    """
    points = pose.points_px[list(CLOTHED)]
    margin = LINE_WIDTH * pose.region.side_px
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    scale = COLOUR_SIDE / max(float((high - low).max()), 1.0)
    matrix = np.array([[scale, 0.0, -scale * low[0]], [0.0, scale, -scale * low[1]]])
    small = cv2.warpAffine(image, matrix, (COLOUR_SIDE, COLOUR_SIDE), borderMode=cv2.BORDER_CONSTANT)
    mask = np.zeros((COLOUR_SIDE, COLOUR_SIDE), np.uint8)
    places = np.rint((pose.points_px - low) * scale).astype(int)
    for begin, end in LINES:
        cv2.line(mask, places[begin].tolist(), places[end].tolist(), 255, max(round(margin * scale), 1))
    corners = np.stack((np.zeros(2), [image.shape[1], image.shape[0]]))
    (left, top), (right, bottom) = np.rint((corners - low) * scale).clip(0, COLOUR_SIDE).astype(int)
    inside = mask[top:bottom, left:right]
    if np.count_nonzero(inside) < max(0.3 * np.count_nonzero(mask), 20):
        return None
    hsv = cv2.cvtColor(small[top:bottom, left:right], cv2.COLOR_BGR2HSV)
    counts = cv2.calcHist([hsv], [0, 1, 2], inside, list(COLOUR_BINS), [0, 180, 0, 256, 0, 256])
    share = _softened(np.asarray(counts, float))
    return np.asarray(share.ravel() / share.sum())


def _softened(counts: Array) -> Array:
    """A histogram of hue, saturation and value, half of each bin added to those beside it; hue is round."""
    result = counts + 0.5 * (np.roll(counts, 1, axis=0) + np.roll(counts, -1, axis=0))
    for axis in (1, 2):
        some = np.moveaxis(result.copy(), axis, 0)
        more = np.moveaxis(result, axis, 0)
        more[1:] += 0.5 * some[:-1]
        more[:-1] += 0.5 * some[1:]
    return result


def colour_distance(a: Array | None, b: Array | None) -> float:
    """Bhattacharyya distance √(1 − Σ√(ab)) of two histograms; 0 where one is unknown."""
    if a is None or b is None:
        return 0.0
    return float(np.sqrt(max(1.0 - np.sqrt(a * b).sum(), 0.0)))
