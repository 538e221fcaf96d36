"""Passes over the frames: forward in time, and backward over what it left open.

The forward pass keeps the frames in which the person is unseen, or seen badly, until they are seen well
again; then a pass backward in time begins there, and of each frame the clearer pose is taken. Where neither
sees anybody, a short time is bridged (`bridging`). What is kept is coded as JPEG, and so many frames at most,
so that memory stays flat.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.video import bridging, choosing
from simrecon.evidence.video.blazepose import Image, Pose
from simrecon.evidence.video.bridging import Seen
from simrecon.evidence.video.choosing import Option
from simrecon.evidence.video.figures import PRESENCE_MIN, alike, clarity, same
from simrecon.evidence.video.tracker import Tracker

KEPT_MAX = 150
"""Frames; five seconds of most videos, some 40 MB of 1080p."""
CLEAR = 0.55
"""Mean score from which a pose is good enough to begin a backward pass at, and to count where only that pass
sees anybody: less is somebody who is half hidden, whose landmarks the network squeezes into what is seen."""
SURE_OFF = 0.3
"""Distance of the colours up to which it is surely the same person, who counts from `SURE_CLARITY` on."""
SURE_CLARITY = 0.3
STEADY = 0.05
"""Change to the next frame, in sides of the region, up to which landmarks are not made up anew."""
LOST_MAX = 15
"""Frames in a row in which the backward pass sees nobody, after which it ends."""
_QUALITY = 95


@dataclass(frozen=True)
class _Kept:
    index: int
    time_s: float
    coded: NDArray[np.uint8]
    pose: Pose | None
    off: float
    """Distance of its colours."""

    @property
    def sure(self) -> bool:
        """Whether the person is clear, and surely the same."""
        return self.pose is not None and clarity(self.pose) >= CLEAR and self.off <= SURE_OFF

    @property
    def image(self) -> Image:
        """The frame (H, W, 3), blue green red."""
        return np.asarray(cv2.imdecode(self.coded, cv2.IMREAD_COLOR), np.uint8)


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
        self._sure: list[Seen] = []  # before them
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
        wrong = anchor is not None and not _at_one_place(pose, anchor)
        if anchor is not None and wrong and self._tracker.may_be(image, anchor):
            pose = self._tracker.begin(image, anchor, time_s)
        agreed = anchor is not None and pose is not None and choosing.agree(pose, anchor)
        self._doubted |= anchor is not None and not agreed
        clear = pose is not None and clarity(pose) >= CLEAR
        sure = clear and self._tracker.colours_off <= SURE_OFF
        full = len(self._kept) >= KEPT_MAX
        if pose is None or not (sure or (clear and full)) or (self._doubted and not agreed and not full):
            self._keep(index, time_s, image, pose)
            return {index: pose}
        now = Seen(time_s, pose)
        settled = self._settle(self._kept, image, now, replaces=wrong) if self._kept else {}
        first = time_s - bridging.VELOCITY_S
        self._sure = [*(one for one in self._sure if one.time_s >= first), now]
        self._kept, self._doubted = [], self._doubted and not agreed
        return {**settled, index: pose}

    def finish(self) -> dict[int, Pose | None]:
        """Poses by index of earlier frames, after the last one."""
        for i in reversed(range(len(self._kept))):
            last = self._kept[i]
            if last.sure and last.pose is not None:
                now = Seen(last.time_s, last.pose)
                return self._settle(self._kept[:i], last.image, now, replaces=False)
        return {}

    def _keep(self, index: int, time_s: float, image: Image, pose: Pose | None) -> None:
        _, coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        kept = _Kept(index, time_s, np.asarray(coded, np.uint8), pose, self._tracker.colours_off)
        self._kept = [*self._kept[-KEPT_MAX + 1 :], kept]

    def _settle(
        self, kept: Sequence[_Kept], image: Image, now: Seen, *, replaces: bool
    ) -> dict[int, Pose | None]:
        """Poses of kept frames that are better known from a later one on: by going back, and by bridging."""
        better: dict[int, _Kept] = {}
        if replaces or self._doubted or any(one.pose is None or clarity(one.pose) < CLEAR for one in kept):
            better = _better(kept, self._backward(kept, image, now), replaces=replaces)
        self.found_backward += len(better)
        best = [better.get(one.index, one) for one in kept]
        return {index: one.pose for index, one in better.items()} | self._bridged(best, now)

    def _bridged(self, kept: Sequence[_Kept], now: Seen) -> dict[int, Pose | None]:
        """Poses of frames with nobody, or somebody doubtful, between times at which the person is sure."""
        sure, hidden, filled = list(self._sure), list[_Kept](), dict[int, Pose | None]()
        later = [*(one.pose for one in kept[1:]), now.pose]
        for one, after in zip(kept, later, strict=True):
            steady = one.pose is not None and after is not None and choosing.change(one.pose, after) <= STEADY
            if one.sure and steady and one.pose is not None:
                seen = Seen(one.time_s, one.pose)
                filled |= self._between(sure, hidden, seen)
                sure, hidden = [*sure, seen], []
            elif one.off > SURE_OFF or not steady:
                hidden.append(one)
        return filled | self._between(sure, hidden, now)

    def _between(
        self, before: Sequence[Seen], hidden: Sequence[_Kept], after: Seen
    ) -> dict[int, Pose | None]:
        """Poses of frames between two times, some without anybody, if the person is the same at both."""
        if all(one.pose is not None for one in hidden) or not bridging.connects(before, after):
            return {}
        poses: dict[int, Pose | None] = {}
        for kept in hidden:
            pose = bridging.expected(before[-1], after, kept.time_s)
            found = self._tracker.network.pose(kept.image, pose.region)
            theirs = found.presence >= PRESENCE_MIN and self._tracker.may_be(kept.image, found, SURE_OFF)
            poses[kept.index] = bridging.with_seen(pose, found) if theirs else pose
        return poses

    def _backward(self, frames: Sequence[_Kept], image: Image, now: Seen) -> dict[int, _Kept]:
        """What is seen in earlier frames, from one in which the person is clear back in time."""
        back = self._tracker.reversed(image, now.pose, now.time_s)
        found: dict[int, _Kept] = {}
        lost = 0
        for kept in reversed(frames):
            seen = back.step(kept.image, -kept.time_s)
            lost = 0 if seen is not None else lost + 1
            if lost > LOST_MAX:
                break
            if seen is not None:
                found[kept.index] = replace(kept, pose=seen, off=back.colours_off)
        return found


def _better(frames: Sequence[_Kept], found: Mapping[int, _Kept], *, replaces: bool) -> dict[int, _Kept]:
    """Those frames that were found better backward than they were seen forward.

    Where the forward pass turned out wrong, `replaces`, its poses give way up to where both agree.
    """
    there = [found.get(one.index) for one in frames]
    options = [
        [Option(one.pose, one.off) for one in both if one is not None and one.pose is not None]
        for both in zip(frames, there, strict=True)
    ]
    taken = choosing.best(options)
    better: dict[int, _Kept] = {}
    for kept, seen, option in reversed(list(zip(frames, there, taken, strict=True))):
        if seen is None or seen.pose is None:
            continue
        replaces = replaces and not _at_one_place(kept.pose, seen.pose)
        least = SURE_CLARITY if seen.off <= SURE_OFF else CLEAR
        fills = kept.pose is None and clarity(seen.pose) >= least
        if fills or replaces or (kept.pose is not None and option == 1):
            better[kept.index] = seen
    return better


def _at_one_place(pose: Pose | None, anchor: Pose) -> bool:
    """Whether two poses of a frame are one person's."""
    return pose is not None and same(pose.region, anchor.region) and alike(pose.region, anchor.region)
