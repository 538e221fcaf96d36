"""What the pose prior is trained and tested on: clips, activities, splits, mirror images.

Held out are subject 03, every fifth recording of each other subject (a recording's two formats stay
together), and all clips of DeepMimic: the synthetic benchmarks are made from those. The fourth recording of
each subject says when to stop.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simrecon import body as bodies
from simrecon.geometry import rotations
from simrecon.types import Array, IntArray
from tools.bench import references
from tools.train import mocap_poses

TEST_SUBJECT = "03"
NEAR_RAD = 0.12
"""A frame closer than this to a kept one of its clip, in its most different joint, is left out."""
FAR_RAD = 0.6
"""A frame that leaves a joint's range by more is a fault of the recording or of its conversion."""
ACTIVITIES: dict[str, str | tuple[str, ...] | dict[str, str]] = {
    "02": ("walk", "walk", "run", "jump", "strike", "bend", "sword", "sword", "sword", "wash"),
    "mass": {"backflip": "acrobatics", "dance": "dance", "kick": "strike", "run": "run", "walk": "walk"},
    "87": "acrobatics", "88": "acrobatics", "108": "acrobatics", "137": "acrobatics",
    "03": "terrain", "01": "climb", "05": "dance", "06": "basketball", "07": "walk",
}  # fmt: skip
ALSO_WALK = {"05_01", "06_01"}
ACROBATICS = ("roll", "getup_faceup", "backflip")


@dataclass(frozen=True, eq=False)
class Poses:
    """Rotation vectors (N, 16, 3) about the joints' rest, clip and activity, share in training."""

    rotvecs: Array
    clips: NDArray[np.str_]
    activities: NDArray[np.str_]
    weights: Array


def load(mocap: Path, cmu: Path) -> dict[str, Poses]:
    """`train`, `validation`, `test` and `acrobatics`.

    Args:
        mocap: folder of `deepmimic`, `mass_bvh` and `mjpc_keyframes`.
        cmu: folder with the unpacked CMU archive.
    """
    parts: dict[str, list[tuple[Array, str, str]]] = {
        "train": [],
        "validation": [],
        "test": [],
        "acrobatics": [],
    }
    recorded = mocap_poses.read_cmu(cmu)
    names = sorted({clip.name for clip in recorded})
    for clip in recorded:
        part = _part(clip.name, names)
        parts[part].append((distinct(rotations.log(clip.joints)), clip.name, activity(clip.name)))
    for clip in mocap_poses.read_mass(mocap / "mass_bvh") + mocap_poses.read_keyframes(
        mocap / "mjpc_keyframes"
    ):
        parts["train"].append((distinct(rotations.log(clip.joints)), clip.name, activity(clip.name)))
    for name in ACROBATICS:
        qpos = references.read(mocap / "deepmimic", name).qpos
        rotvecs = distinct(rotations.log(qpos[:, 7:].reshape(len(qpos), 16, 4)))
        parts["acrobatics"].append((rotvecs, name, "acrobatics"))
    return {part: _joined(clips) for part, clips in parts.items()}


def activity(name: str) -> str:
    """What is done in a recording."""
    subject, clip = name.split("_")
    known = ACTIVITIES[subject]
    if name in ALSO_WALK:
        return "walk"
    if isinstance(known, dict):
        return known[clip]
    return known if isinstance(known, str) else known[int(clip) - 1]


def _part(name: str, names: list[str]) -> str:
    subject = name.split("_")[0]
    if subject == TEST_SUBJECT:
        return "test"
    turn = [other for other in names if other.startswith(subject)].index(name)
    return "test" if turn % 5 == 1 else "validation" if turn == 3 else "train"


def distinct(rotvecs: Array) -> Array:
    """Poses of a clip without near copies and without those far out of range."""
    limits = bodies.template().limits_rad
    excess = np.maximum(rotvecs - limits[..., 1], limits[..., 0] - rotvecs).max(axis=(1, 2))
    kept: list[Array] = []
    for pose in rotvecs[excess < FAR_RAD]:
        near = kept and np.linalg.norm(np.array(kept) - pose, axis=-1).max(axis=-1).min() < NEAR_RAD
        if not near:
            kept.append(pose)
    return np.array(kept).reshape(-1, 16, 3)


def _joined(clips: list[tuple[Array, str, str]]) -> Poses:
    """All clips; an activity weighs as the square root of its number of poses."""
    rotvecs = np.concatenate([clip[0] for clip in clips])
    name = np.repeat([clip[1] for clip in clips], [len(clip[0]) for clip in clips])
    activities = np.repeat([clip[2] for clip in clips], [len(clip[0]) for clip in clips])
    _, index, count = np.unique(activities, return_inverse=True, return_counts=True)
    weights = 1 / np.sqrt(count[index])
    return Poses(rotvecs, name, activities, weights / weights.sum())


def mirrored(rotvecs: Array) -> Array:
    """Left and right exchanged, (..., 16, 3)."""
    names = bodies.template().names[1:]
    swap = {"left": "right", "right": "left"}
    other = [
        names.index("_".join([swap.get(n.split("_")[0], n.split("_")[0]), *n.split("_")[1:]])) for n in names
    ]
    return np.asarray(rotvecs[..., other, :] * np.array([-1.0, 1.0, -1.0]))


def symmetric_basis() -> tuple[Array, Array]:
    """Orthonormal coordinates (S, 48), (A, 48) that stay, and that change their sign, in the mirror."""
    mirror = mirrored(np.eye(48).reshape(48, 16, 3)).reshape(48, 48)
    stay, change = list[Array](), list[Array]()
    done: set[int] = set()
    for i in range(48):
        j = int(np.argmax(np.abs(mirror[i])))
        if i in done or j in done:
            continue
        done |= {i, j}
        e = np.eye(48)
        if i == j:
            (stay if mirror[i, i] > 0 else change).append(e[i])
        else:
            stay.append((e[i] + mirror[i, j] * e[j]) / np.sqrt(2))
            change.append((e[i] - mirror[i, j] * e[j]) / np.sqrt(2))
    return np.array(stay), np.array(change)


def balanced(poses: Poses, count: int, rng: np.random.Generator) -> IntArray:
    """Random rows (count,) in which every recording counts the same."""
    _, index, size = np.unique(poses.clips, return_inverse=True, return_counts=True)
    share = 1 / size[index]
    return rng.choice(len(poses.rotvecs), count, p=share / share.sum())
