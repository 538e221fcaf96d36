"""Short times in which somebody is hidden: where they must be, and what is still seen of them.

Who is seen clearly before and after, goes on as before and looks about the same, is in between on the way
from one to the other. The landmarks are put there; only those that the network sees at these places, on a
person with the same colours, are given a score, and there is no 3D estimate. So a fit hears of nothing that
nobody has seen, and a picture still shows who is followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrecon.evidence.video.blazepose import Pose, Region
from simrecon.evidence.video.figures import BODY, middle
from simrecon.types import Array

LONGEST_S = 0.5
VELOCITY_S = 0.15
"""Before the time in which the person is hidden, over which their velocity is taken."""
# In sides of the region, about 1.3 times the person's height.
ASIDE_MAX = 0.25
"""How far the end may be from where the velocity leads: who jumps comes down elsewhere."""
UNLIKE_MAX = 0.16
"""Mean distance of the landmarks about the trunk at begin and end."""
GROWTH_MAX, TURN_MAX_RAD = 1.25, 0.6
NEAR = 0.06
"""From a landmark's expected place, within which the network's is believed."""
FEWEST = 8
"""Landmarks of the body that must be near, or the network sees somebody else."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Somebody at a time."""

    time_s: float
    pose: Pose


def connects(before: Sequence[Seen], after: Seen) -> bool:
    """Whether the person who was seen before, in order of time, went on to where somebody is seen after."""
    if not before:
        return False
    last, gap_s = before[-1], after.time_s - before[-1].time_s
    side = max(last.pose.region.side_px, 1e-6)
    if gap_s > LONGEST_S or not 1 / GROWTH_MAX <= after.pose.region.side_px / side <= GROWTH_MAX:
        return False
    first = next(one for one in before if one.time_s >= last.time_s - VELOCITY_S)
    lasted = last.time_s - first.time_s
    way = middle(last.pose) - middle(first.pose)
    led = middle(last.pose) + (way * gap_s / lasted if lasted > 0 else 0.0)
    about = [one.pose.points_px[list(BODY)] - middle(one.pose) for one in (last, after)]
    unlike = float(np.linalg.norm(about[1] - about[0], axis=1).mean())
    turn = _turn_rad(last.pose.region, after.pose.region)
    aside = float(np.linalg.norm(middle(after.pose) - led))
    return abs(turn) <= TURN_MAX_RAD and aside <= ASIDE_MAX * side and unlike <= UNLIKE_MAX * side


def expected(before: Seen, after: Seen, time_s: float) -> Pose:
    """The person between two times, on the straight way: nothing of it is seen."""
    share = (time_s - before.time_s) / (after.time_s - before.time_s)
    a, b = before.pose, after.pose

    def between(first: Array, second: Array) -> Array:
        return np.asarray(first + share * (second - first))

    region = Region(
        between(a.region.centre_px, b.region.centre_px),
        float(a.region.side_px ** (1 - share) * b.region.side_px**share),
        a.region.angle_rad + share * _turn_rad(a.region, b.region),
    )
    unknown = np.full_like(a.world_m, np.nan)
    return Pose(between(a.points_px, b.points_px), np.zeros(len(a.scores)), unknown, 0.0, region)


def with_seen(pose: Pose, found: Pose) -> Pose:
    """An expected pose with those landmarks that the network found near them."""
    near = np.linalg.norm(found.points_px - pose.points_px, axis=1) <= NEAR * pose.region.side_px
    if np.count_nonzero(near[list(BODY)]) < FEWEST:
        return pose
    points = np.where(near[:, None], found.points_px, pose.points_px)
    return Pose(points, np.where(near, found.scores, 0.0), pose.world_m, found.presence, pose.region)


def _turn_rad(a: Region, b: Region) -> float:
    return float(np.mod(b.angle_rad - a.angle_rad + np.pi, 2 * np.pi) - np.pi)
