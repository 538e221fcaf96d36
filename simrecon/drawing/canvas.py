"""Drawing on images with OpenCV: polygons, lines, dots, arrows and text, at sub-pixel positions."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array

Image = NDArray[np.uint8]
Colour = tuple[int, int, int]

# Colours are blue, green, red.
DARK: Colour = (30, 26, 24)
LIGHT: Colour = (250, 250, 250)
_GOOD, _BAD = np.array([80, 235, 60]), np.array([60, 50, 240])
_SUPERSAMPLE = 2
_SOFT_PX, _STEP = 0.5, 26.0
"""Less is not evened out; steps of tone much larger than that are edges, and stay."""
_SHIFT = 4  # bits of sub-pixel position that OpenCV is given


def paint(image: Image, polygons_px: Array, colours: Array, alpha: float, soft_px: float = 0.0) -> None:
    """Blend convex polygons (N, P, 2), painted in their order, over an image; edges are smooth.

    Args:
        image: to draw on.
        polygons_px: (N, P, 2).
        colours: (N, 3).
        alpha: opacity.
        soft_px: over which small steps of colour from one polygon to the next are evened out.
    """
    if not len(polygons_px):
        return
    height, width = image.shape[:2]
    low = np.maximum(np.floor(polygons_px.min(axis=(0, 1))).astype(int) - 1, 0)
    high = np.minimum(np.ceil(polygons_px.max(axis=(0, 1))).astype(int) + 2, (width, height))
    if (high <= low).any():
        return
    size = high - low
    canvas = np.zeros((size[1] * _SUPERSAMPLE, size[0] * _SUPERSAMPLE, 4), np.uint8)
    points = _fixed((polygons_px + 0.5 - low) * _SUPERSAMPLE - 0.5)
    tones = np.concatenate((colours, np.full((len(colours), 1), 255.0)), axis=1).tolist()
    for polygon, tone in zip(points, tones, strict=True):
        cv2.fillConvexPoly(canvas, polygon, tone, cv2.LINE_8, _SHIFT)
    layer = cv2.resize(canvas, (int(size[0]), int(size[1])), interpolation=cv2.INTER_AREA)
    part = image[low[1] : high[1], low[0] : high[0]]
    through = cv2.cvtColor(1 - np.float32(alpha / 255) * layer[..., 3], cv2.COLOR_GRAY2BGR)
    behind = cv2.multiply(part, through, dtype=cv2.CV_32F)
    before = cv2.cvtColor(layer, cv2.COLOR_BGRA2BGR)  # painted on black, so it has its share of them already
    if soft_px > _SOFT_PX:
        before = cv2.bilateralFilter(before, 2 * round(min(soft_px, 4.0)) + 3, _STEP, soft_px)
    part[:] = cv2.addWeighted(behind, 1.0, before.astype(np.float32), alpha, 0.0, dtype=cv2.CV_8U)


def areas(polygons_px: Array) -> Array:
    """Areas (N,) of quads (N, 4, 2), negative where they are seen from behind: corners clockwise, y down."""
    a, b = np.moveaxis(polygons_px[:, 2:] - polygons_px[:, :2], 1, 0)  # (N, 2) diagonals
    return np.asarray((a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]) / 2)


def dots(image: Image, pixels: Array, scores: Array) -> None:
    """Draw landmarks (J, 2), red to green by score (J,); NaN and score 0 are left out."""
    radius = max(2.0, max(image.shape[:2]) / 320)
    scores = np.clip(np.nan_to_num(scores), 0, 1)
    for point, score in zip(pixels, scores, strict=True):
        if score <= 0 or not np.isfinite(point).all():
            continue
        x, y = _fixed(point).tolist()
        colour = (_BAD + (_GOOD - _BAD) * score).tolist()
        for grown, tone in ((radius + 1, DARK), (radius, colour)):
            cv2.circle(image, (x, y), round(grown * 2**_SHIFT), tone, -1, cv2.LINE_AA, _SHIFT)


def arrow(image: Image, start_px: Array, end_px: Array, colour: Colour) -> None:
    """Draw an outlined arrow between two points (2,); whole numbers are pixel centres."""
    thick = max(2, round(max(image.shape[:2]) / 400))
    head = min(0.4, 4.0 * thick / max(float(np.linalg.norm(end_px - start_px)), 1.0))
    start, end = _fixed(np.stack((start_px, end_px))).tolist()
    for width, tone in ((thick + 2, DARK), (thick, colour)):
        cv2.arrowedLine(image, start, end, tone, width, cv2.LINE_AA, _SHIFT, head)


def line(image: Image, points_px: Array, colour: Colour, outline: bool) -> None:
    """Draw a thin line through points (N, 2); whole numbers are pixel centres."""
    if len(points_px) < 2:
        return
    points = _fixed(points_px)
    if outline:
        cv2.polylines(image, [points], False, DARK, 3, cv2.LINE_AA, _SHIFT)
    cv2.polylines(image, [points], False, colour, 1, cv2.LINE_AA, _SHIFT)


def hull(mask: NDArray[np.uint8], points_px: Array) -> None:
    """Fill the convex hull of points (N, 2) in a mask (H, W) with 255."""
    cv2.fillConvexPoly(mask, cv2.convexHull(_fixed(points_px)), 255, cv2.LINE_AA, _SHIFT)


def label(image: Image, text: str, line: int, colour: Colour) -> None:
    """Write outlined text at the top left, `line` lines down."""
    size = _text_size(image)
    write(image, text, np.array([20 * size, (36 + 34 * line) * size]), colour)


def _text_size(image: Image) -> float:
    return float(max(0.4, max(image.shape[:2]) / 1600))


def write(image: Image, text: str, at_px: Array, colour: Colour) -> None:
    """Write outlined text that begins at a point (2,), the foot of its letters."""
    (x, y), size, font = np.rint(at_px).astype(int).tolist(), _text_size(image), cv2.FONT_HERSHEY_SIMPLEX
    for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1), (1, 1)):
        cv2.putText(image, text, (x + dx, y + dy), font, size, DARK, 1, cv2.LINE_AA)
    cv2.putText(image, text, (x, y), font, size, colour, 1, cv2.LINE_AA)


def _fixed(pixels: Array) -> NDArray[np.int32]:
    """Pixels in OpenCV's fixed-point numbers."""
    fixed: NDArray[np.int32] = np.clip(np.rint(pixels * 2**_SHIFT), -(2**24), 2**24).astype(np.int32)
    return fixed


def scaled(image: Image, size: tuple[int, int]) -> Image:
    """The image at another size, width and height."""
    if size == (image.shape[1], image.shape[0]):
        return image
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False)
