"""How a camera turns and zooms, from the background of each frame.

Features of a key frame are followed into each new frame; whatever most of them agree on is a homography,
which is what a camera that turns about its centre does to the image, wherever things are. It is found against
a key frame, not against the frame before, so errors don't add up from frame to frame; a frame that has little
left of the key frame becomes one itself, unless an earlier one is nearer. If half of the features stay where
they are, the camera stands still, whatever else moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.video.blazepose import Image, Pose
from simrecon.evidence.video.figures import bounds
from simrecon.types import Array

SIDE_PX = 480
"""Longer side of the image in which features are followed."""
FEATURES_MAX, FEATURES_LEAST = 300, 24
APART_PX, QUALITY = 7, 0.01
AGREE_PX = 1.5
"""Distance from what a homography says, up to which a feature agrees with it; in the small image."""
STILL_SHARE, STILL_PX = 0.5, 0.75
"""So many features that moved less than this are a background that stands still."""
AGREE_SHARE = 0.3
"""Of the features: with fewer that agree, nothing is known of a frame."""
CELLS, CELLS_LEAST = 4, 6
"""The image in 4 × 4 cells: features that agree have to lie in six, or they may be those of one thing."""
RENEW_SHARE = 0.5
"""Of a key frame's features: with fewer that are still there, another key frame is better."""
KEYS_MAX = 48
MARGIN = 0.15
"""About the person's box, in which nothing is followed; in sizes of it."""


@dataclass(frozen=True, eq=False)
class _Key:
    """A frame that others are compared with: small image, features (N, 1, 2), and first image → this one."""

    grey: NDArray[np.uint8]
    points: NDArray[np.float32]
    view: Array


class Background:
    """Follows the background through the frames of a video.

    Attributes:
        views: (3, 3) of each frame so far: the homography from pixels of the first frame to its own, as long
            as it is known, else that of the frame before.
        shares: of the features of each frame, how many agree; 0 where nothing is known.
    """

    def __init__(self) -> None:
        self.views: list[Array] = []
        self.shares: list[float] = []
        self._keys: list[_Key] = []
        self._now = np.eye(3)
        self._scale = 1.0

    def step(self, image: Image, people: Sequence[Pose]) -> None:
        """One more frame.

        Args:
            image: (H, W, 3), blue green red.
            people: those who are known to be in it, and no background.
        """
        self._scale = min(SIDE_PX / max(image.shape[:2]), 1.0)
        small = cv2.resize(image, None, fx=self._scale, fy=self._scale, interpolation=cv2.INTER_AREA)
        grey = np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY), np.uint8)
        share, left = 1.0, 1.0
        if self._keys:
            share, left = self._against_keys(grey, people)
        if not self._keys or (share > 0 and left < RENEW_SHARE):
            self._add(grey, people)
        corner = (self._scale - 1) / 2  # (0, 0) is the centre of the first pixel, in both
        small_from_full = np.array([[self._scale, 0, corner], [0, self._scale, corner], [0, 0, 1.0]])
        view = np.linalg.inv(small_from_full) @ self._now @ small_from_full
        self.views.append(view / view[2, 2])
        self.shares.append(share)

    def _against_keys(self, grey: NDArray[np.uint8], people: Sequence[Pose]) -> tuple[float, float]:
        """Find the view of a frame; the share that agrees, of the features found and of the key frame's."""
        nearest = sorted(self._keys, key=lambda key: _moved_px(self._now @ np.linalg.inv(key.view), grey))
        for key in nearest[:2]:
            matched = self._match(key, grey, people)
            if matched is not None:
                step, share, left = matched
                self._now = step @ key.view
                self._now /= self._now[2, 2]
                return share, left
        return 0.0, 0.0

    def _match(
        self, key: _Key, grey: NDArray[np.uint8], people: Sequence[Pose]
    ) -> tuple[Array, float, float] | None:
        """The homography from a key frame, and the shares of `_against_keys`; None where there is none."""
        if len(key.points) < FEATURES_LEAST:
            return None
        guess = cv2.perspectiveTransform(key.points, self._now @ np.linalg.inv(key.view))
        found, state, _ = cv2.calcOpticalFlowPyrLK(
            key.grey, grey, key.points, guess.astype(np.float32), winSize=(17, 17), maxLevel=3,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )  # fmt: skip
        kept = (state[:, 0] == 1) & self._free(np.asarray(found[:, 0], np.float32), grey.shape, people)
        before, after = key.points[kept, 0], found[kept, 0]
        if len(before) < FEATURES_LEAST:
            return None
        agrees = np.linalg.norm(after - before, axis=1) < STILL_PX
        step: NDArray[np.floating] | None = np.eye(3)
        if agrees.mean() < STILL_SHARE:
            step, inside = cv2.findHomography(before, after, cv2.RANSAC, AGREE_PX)
            agrees = np.ravel(inside) > 0
        share, left = float(agrees.mean()), float(agrees.sum()) / len(key.points)
        if step is None or share < AGREE_SHARE or _cells(after[agrees], grey.shape) < CELLS_LEAST:
            return None
        return np.asarray(step, float), share, left

    def _add(self, grey: NDArray[np.uint8], people: Sequence[Pose]) -> None:
        """Keep a frame as a key frame; the first one stays."""
        mask = np.full(grey.shape, 255, np.uint8)
        for x0, y0, x1, y1 in self._boxes(people):
            mask[max(int(y0), 0) : max(int(y1), 0), max(int(x0), 0) : max(int(x1), 0)] = 0
        points = cv2.goodFeaturesToTrack(grey, FEATURES_MAX, QUALITY, APART_PX, mask=mask)
        points = np.empty((0, 1, 2)) if points is None else points
        if len(self._keys) == KEYS_MAX:
            del self._keys[1]
        self._keys.append(_Key(grey, points.astype(np.float32), self._now.copy()))

    def _free(
        self, points: NDArray[np.float32], shape: tuple[int, ...], people: Sequence[Pose]
    ) -> NDArray[np.bool_]:
        """Whether points (N, 2) are in the image, on nobody who is known."""
        high = np.array([shape[1] - 1, shape[0] - 1])
        free = ((points >= 0) & (points <= high)).all(axis=1)
        for x0, y0, x1, y1 in self._boxes(people):
            free &= ~((points >= (x0, y0)) & (points <= (x1, y1))).all(axis=1)
        return np.asarray(free)

    def _boxes(self, people: Sequence[Pose]) -> list[Array]:
        """Of people in the small image, with a margin: x0 y0 x1 y1."""
        boxes = []
        for pose in people:
            box = bounds(pose) * self._scale
            margin = MARGIN * float(max(box[2] - box[0], box[3] - box[1]))
            boxes.append(box + margin * np.array([-1.0, -1.0, 1.0, 1.0]))
        return boxes


def _moved_px(step: Array, grey: NDArray[np.uint8]) -> float:
    """How far a homography moves the corners of an image, on average."""
    height, width = grey.shape
    corners = np.array([[[0, 0]], [[width, 0]], [[0, height]], [[width, height]]], np.float64)
    moved = cv2.perspectiveTransform(corners, step)
    return float(np.linalg.norm(moved - corners, axis=2).mean())


def _cells(points: NDArray[np.floating], shape: tuple[int, ...]) -> int:
    """In how many cells of the image points (N, 2) lie."""
    rows = np.clip(points[:, ::-1] * CELLS / np.array(shape[:2]), 0, CELLS - 1).astype(int)  # (N, 2)
    return len(np.unique(rows @ [CELLS, 1]))
