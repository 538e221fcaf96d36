"""The motion on the tree of joints that SMPL and SMPL-X share, from the rest pose of a body (`smpl_body`).

Rotations of a joint count from SMPL's rest pose, whose bones are not quite along ours: each joint turns as
our segment does, and then the least way that points its bone at the joint where the person has it. Ankles,
which feet stand on, are reached exactly (`legs`): the hips rise or sink with the lengths of the other legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.evidence.smpl import motion as tree
from simrecon.exports import legs, segments
from simrecon.exports.axes import LOCAL
from simrecon.exports.segments import Segments
from simrecon.exports.smpl_body import SmplBody
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.types import Array, Flags, Skeleton

NAMES = tree.names("smpl")
PARENTS = tree.parents()
OURS = {
    "pelvis": "pelvis", "spine1": "spine", "spine2": "chest", "spine3": "chest", "neck": "neck",
    "head": "head",
    "left_hip": "left_hip", "left_knee": "left_knee", "left_ankle": "left_ankle", "left_foot": "left_ankle",
    "left_collar": "chest", "left_shoulder": "left_shoulder", "left_elbow": "left_elbow",
    "left_wrist": "left_wrist", "left_hand": "left_wrist",
}  # fmt: skip
"""Segments that joints turn with; left side and centre."""
AIMED = {"shoulder": "elbow", "elbow": "wrist"}
"""Joints that point their bone at another one of the person."""


@dataclass(frozen=True, eq=False)
class SmplPose:
    """G frames, 24 joints (`NAMES`).

    Attributes:
        quats: (G, 24, 4) of the joints in the world, z up, counted from the rest pose; w x y z.
        places_m: (G, 24, 3) joint centres.
        trans_m: (G, 3) SMPL's translation.
    """

    quats: Array
    places_m: Array
    trans_m: Array

    @property
    def rotvecs(self) -> Array:
        """Rotation vectors (G, 24, 3) in the parents, the root's in the world."""
        return rotations.log(segments.local(PARENTS, self.quats))


def segment_of(joint: str) -> str:
    """The segment that a joint turns with."""
    ours = OURS[joint.replace("right_", "left_", 1)]
    return ours.replace("left_", "right_", 1) if joint.startswith("right_") else ours


def of_view(view: ResultView, body: SmplBody) -> SmplPose:
    """The motion of a view on a body of SMPL's tree."""
    loaded = legs.feet(view.body.skeleton, view.touching)
    floor_m = view.result.scene.ground.height_m
    return pose(view.body.skeleton, view.segments, body, loaded, floor_m, view.interval_s)


def pose(
    skeleton: Skeleton, posed: Segments, body: SmplBody, loaded: Flags, floor_m: float, interval_s: float
) -> SmplPose:
    """Segments of a person as poses of SMPL's tree.

    Args:
        skeleton: of the person.
        posed: its segments in G frames.
        body: of SMPL's tree.
        loaded: (G, 2) feet that stand, left and right.
        floor_m: height of the ground.
        interval_s: between frames.
    """
    ours = {name: posed.origins_m[:, row] for row, name in enumerate(skeleton.names)}
    since_rest = rotations.from_matrix(np.swapaxes(body.axes, 1, 2) @ LOCAL.T)  # (S, 4)
    base = rotations.multiply(posed.quats, since_rest)  # (G, S, 4)
    solver = _Solver(body.offsets_m, ours, {name: base[:, row] for row, name in enumerate(skeleton.names)})
    return solver.solved(_up_m(solver, ours, loaded, floor_m, interval_s))


def _up_m(solver: _Solver, ours: dict[str, Array], loaded: Flags, floor_m: float, interval_s: float) -> Array:
    """By how much (G, 3) the trunk is higher than the person's, on legs of other lengths."""
    hips = np.stack([ours[f"{side}_hip"] for side in legs.SIDES], axis=1)  # (G, 2, 3)
    ankles = np.stack([ours[f"{side}_ankle"] for side in legs.SIDES], axis=1)
    knees = np.stack([ours[f"{side}_knee"] for side in legs.SIDES], axis=1)
    own_m = np.linalg.norm(knees - hips, axis=-1).mean() + np.linalg.norm(ankles - knees, axis=-1).mean()
    reach_m = float(np.linalg.norm(solver.offset("left_knee")) + np.linalg.norm(solver.offset("left_ankle")))
    over_m = hips[..., 2].mean(axis=1) - legs.standing_height_m(ankles, loaded, floor_m, interval_s)
    up = np.zeros((len(hips), 3))
    up[:, 2] = (reach_m / own_m - 1.0) * np.maximum(over_m, 0.0)
    there = np.stack(solver.hips(up), axis=1)
    up[:, 2] -= legs.sinking_m(there, ankles, loaded, reach_m, interval_s)
    return up


class _Solver:
    """Joints from the root outwards; `at` (G, 3) and `turn` (G, 4) by name hold what is solved."""

    def __init__(self, offsets_m: Array, ours: dict[str, Array], base: dict[str, Array]) -> None:
        self._offsets, self._ours, self._base = offsets_m, ours, base
        self.at: dict[str, Array] = {}
        self.turn: dict[str, Array] = {}

    def offset(self, joint: str) -> Array:
        """Of a joint in its parent."""
        return np.asarray(self._offsets[NAMES.index(joint)])

    def hips(self, up: Array) -> tuple[Array, Array]:
        """Both hips (G, 3): their middle is where the person's is, moved by `up` (G, 3)."""
        root, turn = self._root(up), self._base["pelvis"]
        left, right = (root + rotations.rotate(turn, self.offset(f"{side}_hip")) for side in legs.SIDES)
        return left, right

    def solved(self, up: Array) -> SmplPose:
        """All joints, with the trunk moved by `up` (G, 3)."""
        for joint, parent in zip(NAMES, PARENTS, strict=True):
            if parent < 0:
                self.at[joint] = self._root(up)
            else:
                before = NAMES[parent]
                self.at[joint] = self.at[before] + rotations.rotate(self.turn[before], self.offset(joint))
            self.turn[joint] = self._turned(joint, up)
        places, quats = (np.stack([by[name] for name in NAMES], axis=1) for by in (self.at, self.turn))
        return SmplPose(rotations.canonical(quats), places, places[:, 0] - self.offset("pelvis"))

    def _root(self, up: Array) -> Array:
        middle = 0.5 * (self._ours["left_hip"] + self._ours["right_hip"]) + up
        down = 0.5 * (self.offset("left_hip") + self.offset("right_hip"))
        return np.asarray(middle - rotations.rotate(self._base["pelvis"], down))

    def _turned(self, joint: str, up: Array) -> Array:
        """Orientation (G, 4) of a joint whose place is known."""
        side, _, part = joint.partition("_")
        base, at = self._base[segment_of(joint)], self.at[joint]
        if part == "hip":
            return legs.turned_to(base, self.offset(f"{side}_knee"), self._knee(side, at) - at)
        if part == "knee":
            return legs.turned_to(base, self.offset(f"{side}_ankle"), self._ours[f"{side}_ankle"] - at)
        if joint == "spine2":
            bone = self.offset("spine3") + self.offset("neck")
            return legs.turned_to(base, bone, self._ours["neck"] + up - at)
        if joint == "spine3":
            return self.turn["spine2"]
        if part == "collar":
            place = self._ours[f"{side}_shoulder"] + up
            return legs.turned_to(self.turn["spine3"], self.offset(f"{side}_shoulder"), place - at)
        if part in AIMED:
            end = f"{side}_{AIMED[part]}"
            return legs.turned_to(base, self.offset(end), self._ours[end] + up - at)
        return base

    def _knee(self, side: str, hip: Array) -> Array:
        """Where the knee is that lets the foot stay."""
        bent = self._ours[f"{side}_knee"] - self._ours[f"{side}_hip"]
        bones = np.linalg.norm([self.offset(f"{side}_{end}") for end in ("knee", "ankle")], axis=1)
        forward = rotations.rotate(self._base[f"{side}_hip"], [0.0, 0.0, 1.0])  # the file's axes: z
        return legs.knees(hip, bent, self._ours[f"{side}_ankle"], bones, forward)
