"""Images that a turning camera takes of a textured wall, with somebody before it."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from simrecon.evidence.camera.turning import Views
from simrecon.evidence.video.background import Background
from simrecon.evidence.video.blazepose import Pose, Region
from simrecon.geometry import rotations
from simrecon.types import Lens

SIZE = (480, 270)
FOCAL = 430.0
LENS = Lens(np.array([[FOCAL, 0, 239.5], [0, FOCAL, 134.5], [0, 0, 1]]), np.zeros(5), SIZE)
_WIDE = np.array([[FOCAL, 0, 900], [0, FOCAL, 400], [0, 0, 1]])
"""Intrinsics of the wall's own picture, 1800 x 800."""


def wall(seed: int = 0) -> np.ndarray:
    """A picture with detail at several scales."""
    rng, picture = np.random.default_rng(seed), np.zeros((800, 1800, 3), np.float32)
    for size in (5, 10, 20, 40):
        coarse = rng.uniform(0, 64, (800 // size + 1, 1800 // size + 1, 3)).astype(np.float32)
        picture += cv2.resize(coarse, (1800, 800), interpolation=cv2.INTER_CUBIC)
    return np.clip(picture, 0, 255).astype(np.uint8)


def swaying(frames: int, pan_rad: float = 0.35) -> np.ndarray:
    """Rotations (T, 3, 3) of a hand-held camera that pans there and back; the first is none."""
    share = np.linspace(0, 1, frames)
    tilt, roll = 0.04 * np.sin(9 * share), 0.03 * np.sin(7 * share)
    return rotations.matrix(rotations.exp(np.stack((tilt, pan_rad * np.sin(np.pi * share), roll), axis=1)))


def seen(picture: np.ndarray, homography: np.ndarray) -> np.ndarray:
    """The wall through K R and the inverse of its own intrinsics."""
    return cv2.warpPerspective(picture, homography, SIZE, borderMode=cv2.BORDER_REFLECT)


def turned(picture: np.ndarray, rotation: np.ndarray, zoom: float = 1.0) -> np.ndarray:
    """The wall, infinitely far, from a camera that turned and zoomed."""
    lens = LENS.matrix_px.copy()
    lens[[0, 1], [0, 1]] *= zoom
    return seen(picture, lens @ rotation @ np.linalg.inv(_WIDE))


def somebody(image: np.ndarray, x: float, seed: int = 1) -> Pose:
    """Draw a person with a pattern of their own, 60 x 180 px, and return their pose."""
    rng = np.random.default_rng(seed)
    patch = cv2.resize(rng.integers(0, 255, (36, 12, 3)).astype(np.uint8), (60, 180))
    left = int(x)
    image[60:240, left : left + 60] = patch
    points = np.tile([left + 30.0, 150.0], (33, 1))
    points[11], points[12] = (left, 60), (left + 60, 240)
    region = Region(np.array([left + 30.0, 150.0]), 230.0, 0.0)
    return Pose(points, np.full(33, 0.9), np.zeros((33, 3)), 0.9, region)


def views(images: list[np.ndarray], people: Sequence[tuple[Pose, ...]] | None = None) -> Views:
    """What is found of the background of the images."""
    background = Background()
    for i, image in enumerate(images):
        background.step(image, people[i] if people else ())
    return Views(np.array(background.views), np.array(background.shares))
