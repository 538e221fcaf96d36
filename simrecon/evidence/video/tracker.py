"""Following one person through a video, without hopping to passers-by.

While the person is followed, the landmarks of one frame say where to look in the next one. A pose that lies
too far from the last one, has another size or other colours is not believed; the person then counts as
unseen and is searched for by the detector, in a circle that grows with the time, until a pose with the same
colours is found in it.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simrecon.evidence.video import turned
from simrecon.evidence.video.blazepose import Image, Pose, Region
from simrecon.evidence.video.figures import (
    PRESENCE_MIN,
    SIZE_RATIO_MAX,
    bounds,
    clarity,
    colour_distance,
    colours,
    middle,
)
from simrecon.evidence.video.searching import Network, people, tiles
from simrecon.types import Array

# In sides of the region, about 1.3 times the person's height.
STEP_MAX, SPEED_MAX_PER_S = 0.05, 4.0  # of the middle of the body, while followed
SEARCH_MAX, SEARCH_SPEED_PER_S = 0.35, 1.5  # while searched for
SIZE_GROWTH_PER_S = 1.0
SLOW_RATIO_MAX, SIZE_TIME_S = 1.7, 0.5  # of the size that is remembered, which follows the seen one so slowly
# A pose that is weaker than this is looked for at other angles; another must be clearer by so much, and by
# twice the cost more if it is upside down.
CLARITY_WEAK, CLEARER, TURN_COST = 0.5, 0.1, 0.15
FAST_SHIFT, FAST_TURN_RAD = (
    0.06,
    0.12,
)  # from one frame to the next, in sides of the region; slower is not ahead
# Bhattacharyya distance of the colours, 0 the same to 1 nothing in common: people in a somersault come to
# 0.4, others in other clothes to 0.55 and more.
COLOUR_FOLLOW_MAX, COLOUR_SEARCH_MAX = 0.5, 0.45
COLOUR_EASE_PER_S, COLOUR_EASE_MAX = 0.1, 0.85  # the limit of the search grows: light changes, people turn
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
        colours_off: distance of the last pose's colours from those that were remembered.
    """

    def __init__(self, network: Network, choice: Choice) -> None:
        self.network, self._choice = network, choice
        self._last: Pose | None = None
        self._before: Pose | None = None  # of the frame before the last one, if the person was followed
        self._last_s = self._before_s = self._side_px = 0.0
        self._followed = False
        self._colours: Array | None = None
        self.first: Sequence[Pose] = ()
        self.chosen = -1
        self.losses = 0
        self.colours_off = 0.0

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
            pose = self._follow(image, time_s, since_s)
            if pose is not None:
                return self._take(image, pose, time_s)
            self._followed = False
            self.losses += 1
        return self._search(image, time_s, since_s)

    def _follow(self, image: Image, time_s: float, since_s: float) -> Pose | None:
        """The person where they are expected, upright or turned."""
        ahead = self._ahead(time_s)
        reach = STEP_MAX + SPEED_MAX_PER_S * since_s
        pose = self.network.pose(image, ahead)
        best = pose if self._believed(image, pose, reach, COLOUR_FOLLOW_MAX, 0.0) else None
        if best is None or clarity(best) < CLARITY_WEAK:
            for other in turned.poses(self.network, image, ahead):
                turn = 1 - float(np.cos(other.region.angle_rad - ahead.angle_rad))
                if best is not None and clarity(other) < clarity(best) + CLEARER + TURN_COST * turn:
                    continue
                if self._believed(image, other, reach, COLOUR_FOLLOW_MAX, 0.0):
                    return other
        return best

    def _ahead(self, time_s: float) -> Region:
        """The region of the last frame, moved and turned as from the one before, if that is fast."""
        last, before = self._last, self._before
        if last is None or before is None:
            raise RuntimeError("nobody is followed")
        region, interval = last.region, self._last_s - self._before_s
        if interval <= 0:
            return region
        share = min((time_s - self._last_s) / interval, 1.0)
        shift = share * (region.centre_px - before.region.centre_px)
        turn = share * (np.mod(region.angle_rad - before.region.angle_rad + np.pi, 2 * np.pi) - np.pi)
        if np.linalg.norm(shift) < FAST_SHIFT * region.side_px and abs(turn) < FAST_TURN_RAD:
            return region
        return replace(region, centre_px=region.centre_px + shift, angle_rad=float(region.angle_rad + turn))

    def begin(self, image: Image, pose: Pose, time_s: float) -> Pose:
        """Follow the person of a pose, which is of this frame."""
        self.first, self.chosen, self._followed = (pose,), 0, False
        return self._take(image, pose, time_s)

    @property
    def knows(self) -> bool:
        """Whether there is somebody whom it follows or searches for."""
        return self._last is not None

    def may_be(self, image: Image, pose: Pose, most: float = COLOUR_FOLLOW_MAX) -> bool:
        """Whether a pose can be the person's by its colours, wherever it is."""
        return colour_distance(self._colours, colours(image, pose)) <= most

    def reversed(self, image: Image, pose: Pose, time_s: float) -> Tracker:
        """A tracker of the same person that goes back in time from a frame; its times are negative."""
        other = copy.copy(self)
        other._last, other._last_s, other._followed = None, -time_s, False
        other._take(image, pose, -time_s)
        return other

    def _choose(self, image: Image, time_s: float) -> Pose | None:
        poses = people(self.network, image)
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
        candidates = self.network.candidates(image)
        if not any(self._near(candidate.region, reach) for candidate in candidates):
            for tile in tiles(image.shape[1], image.shape[0]):
                candidates += self.network.candidates(image, tile)
        best: tuple[float, Pose] | None = None
        for candidate in candidates:
            if not self._near(candidate.region, reach):
                continue
            pose = self.network.pose(image, candidate.region)
            if self._believed(image, pose, reach, limit, since_s):
                cost = colour_distance(self._colours, colours(image, pose)) + self._apart(pose.region)
                cost += 1 - clarity(pose) + self._grown(pose.region)
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

    def _grown(self, region: Region) -> float:
        """Logarithm of the region's size over that of the last one, without its sign."""
        last = self._last
        return 0.0 if last is None else abs(float(np.log(region.side_px / max(last.region.side_px, 1e-6))))

    def _near(self, region: Region, reach: float) -> bool:
        return self._apart(region) <= reach

    def _believed(self, image: Image, pose: Pose, reach: float, colour_max: float, since_s: float) -> bool:
        """Whether a pose can be the person's."""
        if self._last is None or pose.presence < PRESENCE_MIN:
            return False
        before = self._last.region
        ratio = pose.region.side_px / max(before.side_px, 1e-6)
        limit = SIZE_RATIO_MAX * (1 + SIZE_GROWTH_PER_S * since_s)
        slow = float(np.log(SLOW_RATIO_MAX * (1 + SIZE_GROWTH_PER_S * since_s)))
        height, width = image.shape[:2]
        x, y = pose.region.centre_px
        half = pose.region.side_px / 2
        inside = -half < x < width + half and -half < y < height + half
        apart = float(np.linalg.norm(middle(pose) - middle(self._last))) / before.side_px
        return (
            inside
            and apart <= reach
            and 1 / limit <= ratio <= limit
            and abs(float(np.log(pose.region.side_px / max(self._side_px, 1e-6)))) <= slow
            and colour_distance(self._colours, colours(image, pose)) <= colour_max
        )

    def _take(self, image: Image, pose: Pose, time_s: float) -> Pose:
        seen = colours(image, pose)
        self.colours_off = apart = colour_distance(self._colours, seen)
        if self._colours is None:
            self._colours = seen
        elif seen is not None:
            step = (1 - apart / COLOUR_FOLLOW_MAX) * min((time_s - self._last_s) / COLOUR_TIME_S, 0.2)
            share = step if apart < COLOUR_FOLLOW_MAX else 1.0  # found by the eased limit: as from now
            self._colours = (1 - share) * self._colours + share * seen
        share = min(abs(time_s - self._last_s) / SIZE_TIME_S, 0.2) if self._followed else 1.0
        self._side_px += share * (pose.region.side_px - self._side_px)
        self._before, self._before_s = (self._last, self._last_s) if self._followed else (None, time_s)
        if self._before is None:
            self._before = pose
        self._last, self._last_s, self._followed = pose, time_s, True
        return pose
