"""Following one person through a video, without hopping to passers-by.

While the person is followed, the landmarks of one frame say where to look in the next one. A pose that lies
too far from the last one, has another size or other colours is not believed; the person then counts as
unseen and is searched for by the detector, in a circle that grows with the time, until a pose with the same
colours is found in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np

from simrecon.evidence.video.blazepose import NAMES, Image, Pose, Region
from simrecon.evidence.video.candidates import Candidate
from simrecon.types import Array

PRESENCE_MIN = 0.5
# In sides of the region, about 1.3 times the person's height.
SAME_PERSON_MAX = 0.25  # two poses this near are one person's
STEP_MAX, SPEED_MAX_PER_S = 0.05, 4.0  # of the middle of the body, while followed
SEARCH_MAX, SEARCH_SPEED_PER_S = 0.35, 1.5  # while searched for
SIZE_RATIO_MAX, SIZE_GROWTH_PER_S = 1.4, 1.5
# Bhattacharyya distance of the trunk's colours, 0 the same to 1 nothing in common.
COLOUR_FOLLOW_MAX, COLOUR_SEARCH_MAX = 0.62, 0.55
COLOUR_EASE_PER_S, COLOUR_EASE_MAX = 0.2, 0.85  # the limit of the search grows: light changes, people turn
COLOUR_TIME_S = 0.5  # in which the remembered colours follow the seen ones, slower if they differ
COLOUR_BINS = (12, 4, 4)  # hue, saturation, value
TRUNK = tuple(NAMES.index(name) for name in ("left_shoulder", "right_shoulder", "right_hip", "left_hip"))


class Network(Protocol):
    """What finds people and their landmarks."""

    def candidates(self, image: Image, tile: tuple[int, int, int, int] | None = None) -> list[Candidate]:
        """People in an image, or in a tile of it."""

    def pose(self, image: Image, region: Region) -> Pose:
        """Landmarks in a region."""


@dataclass(frozen=True)
class Choice:
    """Which person: the N-th by size, from 1 on, or the one at a place in the image; else the largest."""

    number: int | None = None
    at_px: tuple[float, float] | None = None


ANYBODY = Choice()


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


def tiles(width: int, height: int) -> list[tuple[int, int, int, int]]:
    """The image in overlapping squares along its longer side, none for an image that is about square."""
    side = min(width, height)
    longer = max(width, height)
    if longer < 1.2 * side:
        return []
    starts = np.linspace(0, longer - side, int(np.ceil(1.5 * longer / side))).round().astype(int)
    return [(int(s), 0, side, side) if width > height else (0, int(s), side, side) for s in starts]


def people(network: Network, image: Image) -> list[Pose]:
    """Everybody in an image, the largest first; detection in the whole image and in tiles of it."""
    candidates = network.candidates(image)
    for tile in tiles(image.shape[1], image.shape[0]):
        candidates += network.candidates(image, tile)
    poses: list[Pose] = []
    for candidate in sorted(candidates, key=lambda one: -one.score):
        if any(_same(pose.region, candidate.region) for pose in poses):
            continue
        pose = network.pose(image, candidate.region)
        if pose.presence >= PRESENCE_MIN and not any(_same(p.region, pose.region) for p in poses):
            poses.append(pose)
    return sorted(poses, key=lambda pose: -size_px(pose))


def _same(a: Region, b: Region) -> bool:
    apart = float(np.linalg.norm(a.centre_px - b.centre_px))
    ratio = max(a.side_px, b.side_px) / max(min(a.side_px, b.side_px), 1e-6)
    return apart <= SAME_PERSON_MAX * min(a.side_px, b.side_px) and ratio <= SIZE_RATIO_MAX**2


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


class Tracker:
    """Follows one person.

    Args:
        network: finds people and landmarks.
        choice: whom to follow.

    Attributes:
        first: the people in the frame in which the choice was made, the largest first; until then those of
            the frame with most of them.
        losses: how often the person was lost and found again.
    """

    def __init__(self, network: Network, choice: Choice) -> None:
        self._network, self._choice = network, choice
        self._last: Pose | None = None
        self._last_s = 0.0
        self._followed = False
        self._colours: Array | None = None
        self.first: Sequence[Pose] = ()
        self.chosen = -1
        self.losses = 0

    def step(self, image: Image, time_s: float) -> Pose | None:
        """The person in the next frame, None where unseen.

        Args:
            image: (H, W, 3), blue green red.
            time_s: later than the last one's.
        """
        if self._last is None:
            return self._choose(image, time_s)
        since_s = time_s - self._last_s
        if self._followed:
            pose = self._network.pose(image, self._last.region)
            if self._believed(image, pose, STEP_MAX + SPEED_MAX_PER_S * since_s, COLOUR_FOLLOW_MAX, 0.0):
                return self._take(image, pose, time_s)
            self._followed = False
            self.losses += 1
        return self._search(image, time_s, since_s)

    def _choose(self, image: Image, time_s: float) -> Pose | None:
        poses = people(self._network, image)
        index = self._index(poses)
        if index is None:
            if len(poses) > len(self.first):
                self.first = poses
            return None
        self.first, self.chosen = poses, index
        return self._take(image, poses[index], time_s)

    def _index(self, poses: Sequence[Pose]) -> int | None:
        if self._choice.at_px is not None:
            x, y = self._choice.at_px
            boxes = [bounds(pose) for pose in poses]
            there = [i for i, b in enumerate(boxes) if b[0] <= x <= b[2] and b[1] <= y <= b[3]]
            at = np.array([x, y])
            return min(there, key=lambda i: float(np.linalg.norm(middle(poses[i]) - at)), default=None)
        number = (self._choice.number or 1) - 1
        return number if number < len(poses) else None

    def _search(self, image: Image, time_s: float, since_s: float) -> Pose | None:
        reach = SEARCH_MAX + SEARCH_SPEED_PER_S * since_s
        limit = min(COLOUR_SEARCH_MAX + COLOUR_EASE_PER_S * since_s, COLOUR_EASE_MAX)
        candidates = self._network.candidates(image)
        if not any(self._near(candidate.region, reach) for candidate in candidates):
            for tile in tiles(image.shape[1], image.shape[0]):
                candidates += self._network.candidates(image, tile)
        best: tuple[float, Pose] | None = None
        for candidate in candidates:
            if not self._near(candidate.region, reach):
                continue
            pose = self._network.pose(image, candidate.region)
            if self._believed(image, pose, reach, limit, since_s):
                cost = colour_distance(self._colours, colours(image, pose)) + self._apart(pose.region)
                if best is None or cost < best[0]:
                    best = cost, pose
        return None if best is None else self._take(image, best[1], time_s)

    def _apart(self, region: Region) -> float:
        """Distance from where the person was last, in sides of the region."""
        last = self._last
        if last is None:
            return 0.0
        apart = np.linalg.norm(region.centre_px - last.region.centre_px)
        return float(apart) / last.region.side_px

    def _near(self, region: Region, reach: float) -> bool:
        return self._apart(region) <= reach

    def _believed(self, image: Image, pose: Pose, reach: float, colour_max: float, since_s: float) -> bool:
        """Whether a pose can be the person's."""
        if self._last is None or pose.presence < PRESENCE_MIN:
            return False
        before = self._last.region
        ratio = pose.region.side_px / max(before.side_px, 1e-6)
        limit = SIZE_RATIO_MAX * (1 + SIZE_GROWTH_PER_S * since_s)
        height, width = image.shape[:2]
        x, y = pose.region.centre_px
        half = pose.region.side_px / 2
        inside = -half < x < width + half and -half < y < height + half
        apart = float(np.linalg.norm(middle(pose) - middle(self._last))) / before.side_px
        return (
            inside
            and apart <= reach
            and 1 / limit <= ratio <= limit
            and colour_distance(self._colours, colours(image, pose)) <= colour_max
        )

    def _take(self, image: Image, pose: Pose, time_s: float) -> Pose:
        seen = colours(image, pose)
        if self._colours is None:
            self._colours = seen
        elif seen is not None:
            apart = colour_distance(self._colours, seen)
            step = (1 - apart / COLOUR_FOLLOW_MAX) * min((time_s - self._last_s) / COLOUR_TIME_S, 0.2)
            share = step if apart < COLOUR_FOLLOW_MAX else 1.0  # found by the eased limit: as from now
            self._colours = (1 - share) * self._colours + share * seen
        self._last, self._last_s, self._followed = pose, time_s, True
        return pose
