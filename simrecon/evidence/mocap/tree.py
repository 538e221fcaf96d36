"""The joints of a person by their place in the hierarchy.

Of all pairs of limbs (`limbs`), legs and arms are those that make the body most like one: the arm shorter
than the leg, a trunk between them, shoulders wider than hips, all by the proportions and spreads of
`models/body/mocap.toml`. Names of joints help, and tell left from right; where they don't, feet and knees do,
which point forward.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.evidence.mocap import limbs, names
from simrecon.evidence.mocap.hierarchy import Joint
from simrecon.evidence.mocap.limbs import Pair, Tree, deviation
from simrecon.geometry import vectors
from simrecon.types import Array

NEAR = 200  # joints above the shoulders that are looked at
CANDIDATES = 24  # pairs of limbs that are tried as legs and as arms
WORST = 16.0  # misfit of a body, names aside, that is none
AGREED = 0.8  # of the frames, in which a foot or knee points to one side
POINT = 0.01  # of the leg: a branch that reaches no farther ends where it begins
BENT = 0.2  # of the leg: a knee that far out of line shows where it points


def find(joints: Sequence[Joint], places: Array) -> tuple[dict[str, int], list[str]]:
    """Joints of the body by name of the point, and what there is to say of them.

    Args:
        joints: of the hierarchy.
        places: (T, K, 3) of them.

    Returns:
        Nothing where there is no pair of legs and of arms.
    """
    seen = limbs.tree(joints, places)
    chosen = _body(seen)
    if chosen is None:
        return {}, []
    legs, arms = chosen
    legs, notes = _left_first(seen, legs)
    if not _same_order(seen, legs.sides, arms.sides):
        arms = _exchanged(arms)
    at: dict[str, int] = {}
    for pair, points in ((legs, limbs.LEGS), (arms, limbs.ARMS)):
        for side, triple in zip(("left", "right"), pair.sides, strict=True):
            at |= {point.replace("left", side): j for point, j in zip(points, triple, strict=True)}
    for side in ("left", "right"):
        if (ball := _ball(seen, at[f"{side}_ankle"], legs.length)) is not None:
            at[f"{side}_mtp"] = ball
    return at | _neck_and_head(seen, legs, arms), notes


def _body(seen: Tree) -> tuple[Pair, Pair] | None:
    """The pair of legs and the pair of arms that fit each other best."""
    legs = limbs.pairs(seen, limbs.LEGS, "thigh_to_shank")[:CANDIDATES]
    arms = limbs.pairs(seen, limbs.ARMS, "upper_arm_to_forearm")
    best, least = None, np.inf
    for leg in legs:
        for arm in [arm for arm in arms if not _overlap(seen, leg, arm)][: 4 * CANDIDATES]:
            misfit = leg.misfit + arm.misfit + _together(seen, leg, arm)
            if misfit < least:
                best, least = (leg, arm), misfit
    if best is None or _together(seen, *best) > WORST:
        return None
    return best


def _overlap(seen: Tree, a: Pair, b: Pair) -> bool:
    """Whether a branch of one pair lies within the other."""
    above = [set(seen.line(root)) for pair in (a, b) for root in pair.roots]
    ours, theirs = above[0] | above[1], above[2] | above[3]
    return bool(ours & set(b.roots) or theirs & set(a.roots))


def _together(seen: Tree, legs: Pair, arms: Pair) -> float:
    """How badly two pairs of limbs fit one body."""
    hips, shoulders = ([triple[0] for triple in pair.sides] for pair in (legs, arms))
    middle = [seen.places[:, pair].mean(axis=1) for pair in (hips, shoulders)]
    trunk = float(np.median(np.linalg.norm(middle[0] - middle[1], axis=-1)))
    ratios = {
        "arm_to_leg": arms.length,
        "trunk_to_leg": trunk,
        "hips_to_leg": seen.distance(*hips),
        "shoulders_to_leg": seen.distance(*shoulders),
    }
    misfit = sum(deviation(name, length / legs.length) for name, length in ratios.items())
    below, above = (seen.line(pair.roots[0])[1:] for pair in (legs, arms))
    return misfit + (4.0 if len(above) < len(below) else 0.0)


def _left_first(seen: Tree, legs: Pair) -> tuple[Pair, list[str]]:
    """The pair with its left leg first: as names have it, or as feet and knees point; and a note."""
    votes = _named_left(seen, legs)
    points = _forward_left(seen, legs)
    pointed = [vote for vote in points if abs(vote) >= AGREED]
    if votes:
        if len(pointed) == len(points) and all(vote * votes < 0 for vote in pointed):
            note = "left and right are exchanged: by the names feet and knees would point backward"
            return (legs if votes < 0 else _exchanged(legs)), [note]
        return (legs if votes > 0 else _exchanged(legs)), []
    note = "left and right as feet and knees point, for names don't say"
    return (legs if sum(points) >= 0 else _exchanged(legs)), [note]


def _named_left(seen: Tree, pair: Pair) -> int:
    """Names of the joints of a pair for its first limb's being the left one, less those against it."""
    said = [
        names.is_left(*(seen.joints[joint].name for joint in both))
        for both in (*zip(*pair.sides, strict=True), pair.roots)
    ]
    return sum(0 if vote is None else 1 if vote else -1 for vote in said)


def _forward_left(seen: Tree, legs: Pair) -> tuple[float, float]:
    """Share of the frames in which the first leg is the left one, less the others: by feet, by knees."""
    places = seen.places
    hips = places[:, legs.sides[0][0]] - places[:, legs.sides[1][0]]  # (F, 3)
    feet, knees = np.zeros_like(hips), np.zeros_like(hips)
    up = np.zeros_like(hips)
    for hip, knee, ankle in legs.sides:
        thigh, shank = places[:, hip] - places[:, knee], places[:, knee] - places[:, ankle]
        up += vectors.unit(thigh + shank)
        out = vectors.unit(shank) - vectors.unit(thigh)  # where a bent knee points to, for y = x_knee - chord
        knees += np.where(np.linalg.norm(out, axis=-1, keepdims=True) > BENT, out, 0.0)
        ahead = [i for i, joint in enumerate(seen.joints) if joint.parent == ankle]
        reach = [float(np.median(np.linalg.norm(places[:, i] - places[:, ankle], axis=-1))) for i in ahead]
        if ahead and max(reach) > 0:
            feet += vectors.unit(places[:, ahead[int(np.argmax(reach))]] - places[:, ankle])
    left = np.cross(np.stack((feet, knees)), up) * -1.0  # up x forward
    signs = np.sign(np.sum(left * hips, axis=-1))  # (2, F)
    known = np.maximum(np.sum(signs != 0, axis=-1), 1)
    feet_say, knees_say = signs.sum(axis=-1) / known
    return float(feet_say), float(knees_say)


def _same_order(seen: Tree, legs: tuple[limbs.Triple, ...], arms: tuple[limbs.Triple, ...]) -> bool:
    """Whether the first arm is on the side of the first leg."""
    across = [seen.places[:, pair[0][0]] - seen.places[:, pair[1][0]] for pair in (legs, arms)]
    return float(np.median(np.sum(across[0] * across[1], axis=-1))) >= 0


def _exchanged(pair: Pair) -> Pair:
    return Pair((pair.sides[1], pair.sides[0]), (pair.roots[1], pair.roots[0]), pair.length, pair.misfit)


def _ball(seen: Tree, ankle: int, leg: float) -> int | None:
    """The joint of the toes, if the foot has one."""
    children = seen.children
    below = [i for child in children[ankle] for i in (child, *children[child]) if seen.joints[i].name]
    rated = {
        i: deviation("foot_to_leg", seen.distance(ankle, i) / leg)
        - limbs.voted(seen, i, "left_mtp")
        - (2.0 if _reach(seen, children, i) > POINT * leg else 0.0)
        - (1.0 if seen.joints[i].parent == ankle else 0.0)
        for i in below
    }
    best = min(rated, key=lambda i: rated[i], default=None)
    return best if best is not None and rated[best] < limbs.MOST / 2 else None


def _neck_and_head(seen: Tree, legs: Pair, arms: Pair) -> dict[str, int]:
    """Neck and base of the skull: on the way from where the arms hang to the farthest end that is no limb."""
    children = seen.children
    limb = set(legs.roots) | set(arms.roots)
    trunk = set(seen.line(legs.roots[0])[1:])
    start = next(i for i in seen.line(arms.roots[0])[1:])
    below = [i for i in children[start] if i not in limb]
    while not below and start not in trunk and seen.joints[start].parent >= 0:
        before, start = start, seen.joints[start].parent
        below = [i for i in children[start] if i not in limb and i != before]
    joints = [i for child in below for i in _descendants(children, child) if seen.joints[i].name][:NEAR]
    shoulders = seen.places[:, [triple[0] for triple in arms.sides]].mean(axis=1)
    hips = seen.places[:, [triple[0] for triple in legs.sides]].mean(axis=1)
    up = vectors.unit(shoulders - hips)
    height = {
        i: float(np.median(np.sum((seen.places[:, i] - shoulders) * up, axis=-1))) / legs.length
        for i in joints
    }
    rated = {i: _skull_misfit(seen, children, i, height[i], legs.length) for i in joints}
    head = min(rated, key=lambda i: rated[i], default=None)
    if head is None or rated[head] > limbs.MOST:
        return {}
    line = [i for i in seen.line(head)[1:] if i in height]
    necks = {i: 40 * height[i] ** 2 - limbs.voted(seen, i, "neck") for i in line}
    neck = min(necks, key=lambda i: necks[i], default=None)
    return {"skull_base": head} | ({} if neck is None or necks[neck] > limbs.MOST else {"neck": neck})


def _skull_misfit(seen: Tree, children: list[list[int]], joint: int, height: float, leg: float) -> float:
    """How badly a joint is the base of the skull; `height` over the shoulders in lengths of the leg."""
    reach = _reach(seen, children, joint)
    misfit = deviation("neck_to_leg", height) - limbs.voted(seen, joint, "skull_base")
    return misfit + (deviation("skull_to_leg", reach / leg) if reach > POINT * leg else 4.0)


def _reach(seen: Tree, children: list[list[int]], joint: int) -> float:
    """Distance from a joint to the farthest end below it."""
    tips = [i for i in _descendants(children, joint) if not children[i] and i != joint]
    return max((seen.distance(joint, tip) for tip in tips), default=0.0)


def _descendants(children: list[list[int]], joint: int) -> list[int]:
    """A joint and all below it."""
    found = [joint]
    for i in found:  # grows while it is walked along
        found += children[i]
    return found
