"""Looking for somebody who is upside down or on their side: the detector on turned surroundings."""

from __future__ import annotations

import numpy as np

from simrecon.evidence.video.blazepose import Image, Pose, Region, crop
from simrecon.evidence.video.candidates import DETECTOR_SIDE, Candidate
from simrecon.evidence.video.figures import clarity, same
from simrecon.evidence.video.searching import Network

ANGLES = 8
AROUND = 1.4
"""Side of the square that is turned, in sides of the person's region."""
TRIED = 4
"""Candidates whose landmarks are looked at, those with the best scores."""


def poses(network: Network, image: Image, region: Region) -> list[Pose]:
    """Poses about a region, by what the detector finds around it at eight angles; the clearest first."""
    found: list[Candidate] = []
    for k in range(ANGLES):
        angle = region.angle_rad + 2 * np.pi * k / ANGLES
        part = Region(region.centre_px, AROUND * region.side_px, angle)
        inside = network.candidates(crop(image, part, DETECTOR_SIDE))
        found += [placed(candidate, part) for candidate in inside]
    tried: list[Candidate] = []
    for candidate in sorted(found, key=lambda one: -one.score):
        if len(tried) < TRIED and not any(_alike(candidate.region, other.region) for other in tried):
            tried.append(candidate)
    seen = [network.pose(image, candidate.region) for candidate in tried]
    return sorted(seen, key=lambda pose: -clarity(pose))


def placed(candidate: Candidate, part: Region) -> Candidate:
    """A candidate of the square crop of a part of the image, in the image."""
    matrix = part.matrix(DETECTOR_SIDE)
    inside = candidate.region
    region = Region(
        matrix[:, :2] @ inside.centre_px + matrix[:, 2],
        inside.side_px * part.side_px / DETECTOR_SIDE,
        inside.angle_rad + part.angle_rad,
    )
    return Candidate(candidate.score, candidate.box_px, region)


def _alike(a: Region, b: Region) -> bool:
    """Whether two regions would show the network the same."""
    turn = np.cos(a.angle_rad - b.angle_rad)
    return bool(same(a, b) and turn > np.cos(np.pi / ANGLES))
