"""Passes over the frames: forward in time, and backward over what it left open.

The forward pass keeps the frames in which the person is unseen, or seen badly, until they are seen well
again; then a pass backward in time begins there, and of each frame the clearer pose is taken. What is kept is
coded as JPEG, and so many frames at most, so that memory stays flat.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.video.blazepose import Image, Pose
from simrecon.evidence.video.figures import alike, clarity, same
from simrecon.evidence.video.tracker import Tracker

KEPT_MAX = 150
"""Frames; five seconds of most videos, some 40 MB of 1080p."""
CLEAR = 0.55
"""Mean score from which a pose is good enough to begin a backward pass at, and to count where only that pass
sees anybody: less is somebody who is half hidden, whose landmarks the network squeezes into what is seen."""
CLEARER = 0.03
"""By so much the backward pass has to be better than the forward one."""
LOST_MAX = 15
"""Frames in a row in which the backward pass sees nobody, after which it ends."""
_QUALITY = 95


@dataclass(frozen=True)
class _Kept:
    index: int
    time_s: float
    coded: NDArray[np.uint8]
    pose: Pose | None


class Passes:
    """Forward over the frames, and backward where it helps.

    Args:
        tracker: follows the person, who may have to be pointed out to it (`begin`).

    Attributes:
        found_backward: how many frames have their pose of the backward pass.
    """

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._kept: list[_Kept] = []
        self._doubted, self._losses = False, 0  # since the person was lost, until an anchor agrees
        self.found_backward = 0

    def step(
        self, index: int, image: Image, time_s: float, anchor: Pose | None = None, *, waits: bool = False
    ) -> dict[int, Pose | None]:
        """One more frame.

        Args:
            index: of it.
            image: (H, W, 3), blue green red.
            time_s: later than the last one's.
            anchor: the person in this frame as somebody else knows them: where the tracker begins, and
                where it is corrected.
            waits: whether the tracker is to be told later whom to follow.

        Returns:
            Poses by index: of this frame, and of earlier ones that are seen better now.
        """
        known = self._tracker.knows
        pose = None if waits or (anchor is not None and not known) else self._tracker.step(image, time_s)
        self._doubted |= self._tracker.losses > self._losses
        self._losses = self._tracker.losses
        wrong = anchor is not None and not _agree(pose, anchor)
        if anchor is not None and wrong and self._tracker.may_be(image, anchor):
            pose = self._tracker.begin(image, anchor, time_s)
        if pose is None or clarity(pose) < CLEAR or (self._doubted and anchor is None):
            _, coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
            self._kept = [*self._kept[-KEPT_MAX + 1 :], _Kept(index, time_s, coded, pose)]
            return {index: pose}
        better = self._backward(image, pose, time_s, replaces=wrong) if self._kept else {}
        self._kept, self._doubted = [], False
        return {**better, index: pose}

    def _backward(self, image: Image, pose: Pose, time_s: float, *, replaces: bool) -> dict[int, Pose | None]:
        """From a frame in which the person is clear over those that were kept.

        Where the forward pass turned out wrong, `replaces`, its poses give way up to where both agree.
        """
        back = self._tracker.reversed(image, pose, time_s)
        better: dict[int, Pose | None] = {}
        lost = 0
        for kept in reversed(self._kept):
            earlier = np.asarray(cv2.imdecode(kept.coded, cv2.IMREAD_COLOR), np.uint8)
            seen = back.step(earlier, -kept.time_s)
            lost = 0 if seen is not None else lost + 1
            if lost > LOST_MAX:
                break
            replaces = replaces and not (
                seen is not None and kept.pose is not None and _agree(kept.pose, seen)
            )
            least = CLEAR if kept.pose is None else clarity(kept.pose) + CLEARER
            worse = seen is None or clarity(seen) < least
            if worse and not (replaces and seen is not None):
                continue
            better[kept.index] = seen
        self.found_backward += len(better)
        return better


def _agree(pose: Pose | None, anchor: Pose) -> bool:
    """Whether two poses of a frame are one person's, seen alike."""
    return pose is not None and same(pose.region, anchor.region) and alike(pose.region, anchor.region)
