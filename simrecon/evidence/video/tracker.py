"""Following one person through a video, without hopping to passers-by.

While the person is followed, the landmarks of one frame say where to look in the next one. A pose that lies
too far from the last one, has another size or other colours is not believed; the person then counts as
unseen and is searched for by the detector, in a circle that grows with the time, until a pose with the same
colours is found in it.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrecon.evidence.video.blazepose import Image, Pose, Region
from simrecon.evidence.video.figures import (
    PRESENCE_MIN,
    SIZE_RATIO_MAX,
    bounds,
    colour_distance,
    colours,
    middle,
)
from simrecon.evidence.video.searching import Network, people, tiles
from simrecon.types import Array

# In sides of the region, about 1.3 times the person's height.
STEP_MAX, SPEED_MAX_PER_S = 0.05, 4.0  # of the middle of the body, while followed
SEARCH_MAX, SEARCH_SPEED_PER_S = 0.35, 1.5  # while searched for
SIZE_GROWTH_PER_S = 1.5
# Bhattacharyya distance of the trunk's colours, 0 the same to 1 nothing in common.
COLOUR_FOLLOW_MAX, COLOUR_SEARCH_MAX = 0.62, 0.55
COLOUR_EASE_PER_S, COLOUR_EASE_MAX = 0.2, 0.85  # the limit of the search grows: light changes, people turn
COLOUR_TIME_S = 0.5  # in which the remembered colours follow the seen ones, slower if they differ


@dataclass(frozen=True)
class Choice:
    """Which person: by number (`survey`), from 1 on, or the one at a place in the image; else number 1."""

    number: int | None = None
    at_px: tuple[float, float] | None = None


ANYBODY = Choice()


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

    def begin(self, image: Image, pose: Pose, time_s: float) -> Pose:
        """Follow the person of a pose, which is of this frame."""
        self.first, self.chosen = (pose,), 0
        return self._take(image, pose, time_s)

    def reversed(self, image: Image, pose: Pose, time_s: float) -> Tracker:
        """A tracker of the same person that goes back in time from a frame; its times are negative."""
        other = copy.copy(self)
        other._last, other._last_s = None, -time_s
        other._take(image, pose, -time_s)
        return other

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
