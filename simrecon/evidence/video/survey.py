"""Who is in a video, before anybody is followed: some frames are looked at, and people in them told apart.

Everybody in a frame is a sighting. Sightings are one person's if colours, size and place are near enough; no
two of a frame are. People are numbered by how well they are seen over the clip:

    mean over the frames of (size / image side · mean score) · (1 + motion)

with zero where they are not seen, and `motion` what body and landmarks move by from one sighting to the
next, in sizes, one at most. So who stands at the edge, is small, or passes through comes after others.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simrecon.evidence.cutting import Span
from simrecon.evidence.video import frames, searching
from simrecon.evidence.video.blazepose import Image, Pose
from simrecon.evidence.video.figures import bounds, clarity, colour_distance, colours, middle, size_px
from simrecon.evidence.video.searching import Network
from simrecon.types import Array

SAMPLES = 16
"""Frames that are looked at, about: what half of a second shows in a clip of eight."""
APART_MAX = 0.75
"""Cost at which two sightings are of two people."""
COLOUR_COST, SIZE_COST, PLACE_COST = 1.5, 0.3, 0.1
"""Of colours that have nothing in common, a size that is e times as large, and a place one size away."""
PLACE_MAX = 2.0
COLOUR_SHARE, COLOUR_NEAR = 0.3, 0.3
"""Of a new sighting's colours in those that are remembered, if they are so near: else it is half hidden."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """One person in one frame: `row` of the video, the pose, the colours of the trunk if they are seen."""

    row: int
    pose: Pose
    colours: Array | None


@dataclass(frozen=True, eq=False)
class Survey:
    """What was seen.

    Attributes:
        rows: numbers of the frames that were looked at.
        people: sightings of each person in order of time, those who are seen best first.
    """

    rows: tuple[int, ...]
    people: tuple[tuple[Sighting, ...], ...]

    def boxes(self) -> Array:
        """(M, 6) of each sighting: row, index of the person, x0 y0 x1 y1."""
        found = [[one.row, i, *bounds(one.pose)] for i, person in enumerate(self.people) for one in person]
        return np.array(found, float).reshape(-1, 6)

    def at(self, x: float, y: float) -> tuple[int, Sighting] | None:
        """The first sighting at a place in the image, the nearest if several are, with the person's index."""
        there = []
        for i, person in enumerate(self.people):
            for one in person:
                left, top, right, bottom = bounds(one.pose)
                if left <= x <= right and top <= y <= bottom:
                    apart = float(np.linalg.norm(middle(one.pose) - [x, y]))
                    there.append((one.row, apart, i, one))
        first = min(there, key=lambda entry: entry[:3], default=None)
        return None if first is None else (first[2], first[3])


def survey(path: Path, network: Network, span: Span, count: int, **reading: float | None) -> Survey:
    """Look at some frames of a video.

    Args:
        path: of the video.
        network: finds people and landmarks.
        span: of it.
        count: about how many frames that has.
        reading: `fps`, `interval_s` and `turn_deg`, as `frames.frames` takes them.
    """
    sparse = replace(span, every=span.every * max(1, count // SAMPLES))
    known = _People()
    rows = []
    for frame in frames.frames(path, sparse, **reading):  # type: ignore[arg-type]
        rows.append(frame.row)
        known.add(frame.row, frame.image, searching.people(network, frame.image))
    shape = () if not rows else frame.image.shape
    side = min(shape[:2], default=1)
    ranked = sorted(known.people, key=lambda person: -worth(person, len(rows), side))
    return Survey(tuple(rows), tuple(tuple(person) for person in ranked))


def worth(person: Sequence[Sighting], looked: int, side_px: int) -> float:
    """How well a person is seen over so many frames, of images with this shorter side."""
    seen = sum(size_px(one.pose) / side_px * clarity(one.pose) for one in person) / max(looked, 1)
    return float(seen * (1 + min(_motion(person), 1.0)))


def _motion(person: Sequence[Sighting]) -> float:
    """Mean way of the middle and of the landmarks about it from one sighting to the next, in sizes."""
    moved = []
    for before, after in itertools.pairwise(person):
        shift = middle(after.pose) - middle(before.pose)
        change = np.linalg.norm(after.pose.points_px - before.pose.points_px - shift, axis=1).mean()
        moved.append(float(np.linalg.norm(shift) + change) / max(size_px(after.pose), 1e-6))
    return float(np.mean(moved)) if moved else 0.0


class _People:
    """Sightings so far, by person."""

    def __init__(self) -> None:
        self.people: list[list[Sighting]] = []
        self._colours: list[Array | None] = []

    def add(self, row: int, image: Image, poses: Sequence[Pose]) -> None:
        """Everybody in one more frame."""
        seen = [Sighting(row, pose, colours(image, pose)) for pose in poses]
        costs = [(self._cost(i, one), k, i) for k, one in enumerate(seen) for i in range(len(self.people))]
        taken: dict[int, int] = {}
        for cost, k, i in sorted(costs):
            if cost <= APART_MAX and k not in taken and i not in taken.values():
                taken[k] = i
        for k, one in enumerate(seen):
            if k in taken:
                self._join(taken[k], one)
            else:
                self.people.append([one])
                self._colours.append(one.colours)

    def _cost(self, person: int, one: Sighting) -> float:
        last = self.people[person][-1].pose
        larger = abs(np.log(max(size_px(one.pose), 1e-6) / max(size_px(last), 1e-6)))
        apart = float(np.linalg.norm(middle(one.pose) - middle(last))) / max(size_px(last), 1e-6)
        hue = colour_distance(self._colours[person], one.colours)
        return float(COLOUR_COST * hue + SIZE_COST * larger + PLACE_COST * min(apart, PLACE_MAX))

    def _join(self, person: int, one: Sighting) -> None:
        self.people[person].append(one)
        before = self._colours[person]
        if before is None:
            self._colours[person] = one.colours
        elif one.colours is not None and colour_distance(before, one.colours) <= COLOUR_NEAR:
            self._colours[person] = (1 - COLOUR_SHARE) * before + COLOUR_SHARE * one.colours


def described(sightings: Array, looked: int) -> str:
    """People of sightings (M, 6) by number, with place, mean size, and in how many frames, for messages."""
    words = []
    for i in range(int(sightings[:, 1].max()) + 1 if len(sightings) else 0):
        own = sightings[sightings[:, 1] == i]
        wide, high = (own[:, 4] - own[:, 2]).mean(), (own[:, 5] - own[:, 3]).mean()
        size = f"{high:.0f} px high" if high >= wide else f"{wide:.0f} px wide"
        x, y = (own[0, 2] + own[0, 4]) / 2, (own[0, 3] + own[0, 5]) / 2
        words.append(
            f"{i + 1} (at {x:.0f},{y:.0f} in frame {own[0, 0]:.0f}, {size}, in {len(own)} of {looked})"
        )
    return ", ".join(words)
