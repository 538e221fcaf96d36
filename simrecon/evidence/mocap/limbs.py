"""Which joints of a hierarchy are a pair of limbs: three on either side, by place, proportion and name.

A limb is a joint that carries two straight bones one after the other: hip, knee and ankle, or shoulder, elbow
and wrist. All such triples within a branch of the tree are rated in squared deviations of their proportions
(`models/body/mocap.toml`, `[proportion]`), less what their names say for them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from simrecon.evidence.mocap import names
from simrecon.evidence.mocap.hierarchy import Joint
from simrecon.types import Array, IntArray

Triple = tuple[int, int, int]

FRAMES = 60  # spread over the clip, which show what bends
DEPTH, WIDTH, BRANCHES, KEPT, ENDS = 10, 60, 16, 12, 2  # bounds on absurd trees
STRAIGHT = 0.02  # a bone's length that varies by more of itself is none
MOST = 12.0  # a single deviation, squared, counts no more
MIRRORED, LOPSIDED = 0.05, 0.22  # shares by which bones on the left and right differ, usually and at most
LONGER = 4.0  # of two limbs with equal proportions the longer one by a factor e is that much better
LEGS = ("left_hip", "left_knee", "left_ankle")
ARMS = ("left_shoulder", "left_elbow", "left_wrist")


@dataclass(frozen=True)
class Tree:
    """A hierarchy with what its motion shows.

    Attributes:
        joints: of the hierarchy, end sites included; parents come before their children.
        places: (F, K, 3) in some frames.
        words: what the name of each joint says, by point (`names.words`).
    """

    joints: Sequence[Joint]
    places: Array
    words: Sequence[dict[str, float]]

    @cached_property
    def children(self) -> list[list[int]]:
        """Of every joint."""
        below: list[list[int]] = [[] for _ in self.joints]
        for i, joint in enumerate(self.joints):
            if joint.parent >= 0:
                below[joint.parent].append(i)
        return below

    def line(self, joint: int) -> list[int]:
        """A joint and all above it, upwards."""
        chain = []
        while joint >= 0:
            chain.append(joint)
            joint = self.joints[joint].parent
        return chain

    def distance(self, a: int, b: int) -> float:
        """Median distance of two joints."""
        return float(np.median(np.linalg.norm(self.places[:, a] - self.places[:, b], axis=-1)))


@dataclass(frozen=True)
class Limb:
    """Three joints, the lengths of the two bones between them, and how badly they fit."""

    joints: Triple
    bones: tuple[float, float]
    misfit: float


@dataclass(frozen=True)
class Pair:
    """A pair of limbs: three joints on either side, their mean length, and how badly they fit."""

    sides: tuple[Triple, Triple]
    roots: tuple[int, int]
    length: float
    misfit: float


def tree(joints: Sequence[Joint], places: Array) -> Tree:
    """The tree of a hierarchy; places (T, K, 3)."""
    rows = np.unique(np.linspace(0, len(places) - 1, min(len(places), FRAMES)).round().astype(int))
    return Tree(joints, places[rows], names.words([joint.name for joint in joints]))


def deviation(name: str, ratio: float) -> float:
    """Squared deviation of a ratio from the body's, at most `MOST`."""
    middle, spread = names.table("proportion")[name]
    return float(min(((math.log(max(ratio, 1e-9)) - middle) / spread) ** 2, MOST))


def pairs(seen: Tree, points: tuple[str, str, str], ratio: str) -> list[Pair]:
    """Pairs of limbs that hang from a common joint, best first.

    Args:
        seen: the hierarchy.
        points: names of the three joints, on the left.
        ratio: of the two bones, in `[proportion]`.
    """
    size = float(np.median(np.ptp(seen.places, axis=1).max(axis=1)))
    found: list[Pair] = []
    rated: dict[int, list[Limb]] = {}
    for a, b in _siblings(seen):
        for branch in (a, b):
            if branch not in rated:
                rated[branch] = _limbs(seen, branch, points, ratio)
        for left, right in ((x, y) for x in rated[a] for y in rated[b]):
            apart = [abs(math.log(x / y)) for x, y in zip(left.bones, right.bones, strict=True)]
            if max(apart) > LOPSIDED:
                continue
            length = (sum(left.bones) + sum(right.bones)) / 2
            misfit = left.misfit + right.misfit + sum(min((gap / MIRRORED) ** 2, MOST) for gap in apart)
            misfit -= 2 * LONGER * math.log(length / max(size, 1e-12))
            found.append(Pair((left.joints, right.joints), (a, b), length, misfit))
    return sorted(found, key=lambda pair: pair.misfit)


def _siblings(seen: Tree) -> Iterator[tuple[int, int]]:
    """Pairs of children of one joint under which a limb has room, those of the longest branches."""
    count = len(seen.joints)
    depth, reach = np.ones(count, int), np.zeros(count)
    for i in reversed(range(count)):
        above = seen.joints[i].parent
        if above >= 0:
            depth[above] = max(depth[above], depth[i] + 1)
            reach[i] += float(np.median(np.linalg.norm(seen.places[:, i] - seen.places[:, above], axis=-1)))
            reach[above] = max(reach[above], reach[i])
    roomy = [
        sorted((child for child in children if depth[child] >= len(LEGS)), key=lambda c: -reach[c])[:KEPT]
        for children in seen.children
    ]
    branching = sorted((group for group in roomy if len(group) > 1), key=lambda group: -reach[group[1]])
    for children in branching[:BRANCHES]:
        yield from combinations(children, 2)


def _below(seen: Tree, branch: int) -> list[list[int]]:
    """Lines from a branch's first joint down to each of its joints, the nearest ones."""
    children, lines = seen.children, [[branch]]
    for line in lines:  # grows while it is walked along
        if len(line) < DEPTH and len(lines) < WIDTH:
            lines += [[*line, child] for child in children[line[-1]]]
    return lines[:WIDTH]


def _limbs(seen: Tree, branch: int, points: tuple[str, str, str], ratio: str) -> list[Limb]:
    """The best limbs of a branch."""
    lines = _below(seen, branch)
    rows: IntArray = np.array([line[-1] for line in lines])
    index = {int(row): i for i, row in enumerate(rows)}
    places = seen.places[:, rows]
    spans = np.linalg.norm(places[:, :, None] - places[:, None], axis=-1)  # (F, B, B)
    middle = np.median(spans, axis=0)
    spread = np.quantile(spans, 0.95, axis=0) - np.quantile(spans, 0.05, axis=0)
    bends = np.minimum((spread / (STRAIGHT * np.maximum(middle, 1e-9))) ** 2, MOST)
    found = []
    for line in lines:
        for start, middle_joint in combinations(line[:-1], 2):
            i, k, m = index[start], index[middle_joint], index[line[-1]]
            upper, lower = float(middle[i, k]), float(middle[k, m])
            if min(upper, lower) <= 1e-6 * float(middle.max(initial=0.0)):
                continue
            triple = (start, middle_joint, line[-1])
            said = sum(voted(seen, joint, point) for joint, point in zip(triple, points, strict=True))
            misfit = deviation(ratio, upper / lower) + float(bends[i, k] + bends[k, m]) - said
            found.append(Limb(triple, (upper, lower), misfit))
    best: list[Limb] = []
    ends: dict[tuple[int, int], int] = {}
    for limb in sorted(found, key=lambda limb: limb.misfit - LONGER * math.log(sum(limb.bones))):
        ends[limb.joints[:2]] = ends.get(limb.joints[:2], 0) + 1
        if ends[limb.joints[:2]] <= ENDS and len(best) < KEPT:  # fingers leave room for the rest
            best.append(limb)
    return best


def voted(seen: Tree, joint: int, point: str) -> float:
    """What a joint's name says for its being a point, in squared deviations."""
    said = seen.words[joint]
    against = max((vote for name, vote in said.items() if name != point), default=0.0)
    return said.get(point, 0.0) or -against
