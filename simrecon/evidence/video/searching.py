"""Looking for people in an image: the detector on the whole of it and on tiles, then landmarks of each."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from simrecon.evidence.video.blazepose import Image, Pose, Region
from simrecon.evidence.video.candidates import Candidate
from simrecon.evidence.video.figures import is_person, same, size_px


class Network(Protocol):
    """What finds people and their landmarks."""

    def candidates(self, image: Image, tile: tuple[int, int, int, int] | None = None) -> list[Candidate]:
        """People in an image, or in a tile of it."""

    def pose(self, image: Image, region: Region) -> Pose:
        """Landmarks in a region."""


def tiles(width: int, height: int) -> list[tuple[int, int, int, int]]:
    """The image in overlapping squares along its longer side, none for an image that is about square."""
    side = min(width, height)
    longer = max(width, height)
    if longer < 1.2 * side:
        return []
    starts = np.linspace(0, longer - side, int(np.ceil(1.5 * longer / side))).round().astype(int)
    return [(int(s), 0, side, side) if width > height else (0, int(s), side, side) for s in starts]


def people(network: Network, image: Image) -> list[Pose]:
    """Everybody in an image who can be a person, the largest first; by the whole image and tiles of it."""
    candidates = network.candidates(image)
    for tile in tiles(image.shape[1], image.shape[0]):
        candidates += network.candidates(image, tile)
    poses: list[Pose] = []
    for candidate in sorted(candidates, key=lambda one: -one.score):
        if any(same(pose.region, candidate.region) for pose in poses):
            continue
        pose = network.pose(image, candidate.region)
        if is_person(pose) and not any(same(p.region, pose.region) for p in poses):
            poses.append(pose)
    return sorted(poses, key=lambda pose: -size_px(pose))
