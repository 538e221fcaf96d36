"""Skeletons of animation programs as BVH, variations of one person who walks; and where the joints are."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from simrecon.geometry import rotations

FRAMES = 24
RIGHT = {"Left": "Right"}
POINTS = {
    "neck": "Neck", "skull_base": "Head", "left_shoulder": "LeftArm", "left_elbow": "LeftForeArm",
    "left_wrist": "LeftHand", "left_hip": "LeftUpLeg", "left_knee": "LeftLeg", "left_ankle": "LeftFoot",
    "left_mtp": "LeftToeBase",
}  # fmt: skip


@dataclass(frozen=True)
class Bone:
    """A joint: offset in cm, y up and z forward; `six`: it has position channels too."""

    name: str
    parent: str
    offset: tuple[float, float, float]
    end: tuple[float, float, float] | None = None
    six: bool = False


_LEFT = (
    Bone("LeftShoulder", "Spine1", (4, 16, 0)), Bone("LeftArm", "LeftShoulder", (13, 0, 0)),
    Bone("LeftForeArm", "LeftArm", (28, 0, 0)), Bone("LeftHand", "LeftForeArm", (25, 0, 0), (18, 0, 0)),
    Bone("LeftUpLeg", "Hips", (9, -4, 0)), Bone("LeftLeg", "LeftUpLeg", (0, -41, 0)),
    Bone("LeftFoot", "LeftLeg", (0, -40, 0)), Bone("LeftToeBase", "LeftFoot", (0, -6, 14), (0, 0, 6)),
)  # fmt: skip


def mirrored(bones: Iterable[Bone]) -> tuple[Bone, ...]:
    """Bones of the left side and their mirror images."""
    both = []
    for bone in bones:
        x, y, z = bone.offset
        end = None if bone.end is None else (-bone.end[0], *bone.end[1:])
        name, parent = bone.name.replace("Left", "Right"), bone.parent.replace("Left", "Right")
        both += [bone, Bone(name, parent, (-x, y, z), end, bone.six)]
    return tuple(both)


PERSON = (
    Bone("Hips", "", (0, 0, 0)), Bone("Spine", "Hips", (0, 12, 0)), Bone("Spine1", "Spine", (0, 18, 0)),
    Bone("Neck", "Spine1", (0, 22, 0)), Bone("Head", "Neck", (0, 10, 2), (0, 18, 0)), *mirrored(_LEFT),
)  # fmt: skip


def without(bones: Iterable[Bone], *names: str) -> tuple[Bone, ...]:
    """Bones without some, whose children hang from their parents, where they are."""
    kept = list(bones)
    for name in names:
        gone = next(bone for bone in kept if bone.name == name)
        kept.remove(gone)
        for i, bone in enumerate(kept):
            if bone.parent == name:
                offset = tuple(np.add(bone.offset, gone.offset).tolist())
                kept[i] = replace(bone, parent=gone.parent, offset=offset)
    return tuple(kept)


def split(bones: Iterable[Bone], name: str, *between: str) -> tuple[Bone, ...]:
    """Bones with further joints on the way to one, at equal distances."""
    kept: list[Bone] = []
    for bone in bones:
        if bone.name != name:
            kept.append(bone)
            continue
        step = tuple((np.array(bone.offset) / (len(between) + 1)).tolist())
        parent = bone.parent
        for inner in between:
            kept.append(Bone(inner, parent, step))
            parent = inner
        kept.append(replace(bone, parent=parent, offset=step))
    return tuple(kept)


def renamed(bones: Iterable[Bone], name: Callable[[str], str]) -> tuple[Bone, ...]:
    """Bones under other names."""
    return tuple(
        replace(bone, name=name(bone.name), parent=bone.parent and name(bone.parent)) for bone in bones
    )


def _angles(name: str, phase: float) -> tuple[float, float, float]:
    """Degrees about x, y, z in a step; what is not of a limb or the trunk stays as it is."""
    swing = np.sin(phase + (np.pi if "Right" in name else 0.0))
    side = -1.0 if "Right" in name else 1.0
    return {
        "Hips": (3.0, 10.0 * swing, 2.0), "Spine": (2.0, -8.0 * swing, 0.0), "Head": (4.0 * swing, 0.0, 0.0),
        "UpLeg": (-10.0 + 22.0 * swing, 4.0, 3.0 * side), "Leg": (25.0 + 20.0 * swing, 0.0, 0.0),
        "Foot": (-8.0 + 6.0 * swing, 0.0, 0.0), "Arm": (15.0 * swing, 0.0, -65.0 * side),
        "ForeArm": (0.0, -25.0 * side, 0.0),
    }.get(name.removeprefix("Left").removeprefix("Right"), (0.0, 0.0, 0.0))  # fmt: skip


def bvh(
    bones: tuple[Bone, ...],
    *,
    meaning: Callable[[str], str] = lambda name: name,
    unit: float = 1.0,
    world: np.ndarray | None = None,
    zero: bool = False,
    extra: dict[str, tuple[float, float, float]] | None = None,
    turned: Callable[[int], np.ndarray] | None = None,
    hips: float = 90.5,
) -> tuple[str, dict[str, np.ndarray]]:
    """A file, and places (T, 3) of its joints by name, in its own unit and axes.

    Args:
        bones: parents before children.
        meaning: what a bone is called in `PERSON`, after whose name it moves.
        unit: of the file in cm.
        world: (3, 3) from y up and z forward to the file's axes.
        zero: whether position channels below the root hold what is added to the offset.
        extra: degrees about x, y, z that a joint is turned by in every frame, before it moves.
        hips: their height, cm.
        turned: (3, 3) of the hips by frame, about themselves, instead of walking.
    """
    axes = np.eye(3) if world is None else world
    children = {bone.name: [b for b in bones if b.parent == bone.name] for bone in bones}
    places: dict[str, np.ndarray] = {bone.name: np.zeros((FRAMES, 3)) for bone in bones}
    rows: list[list[float]] = [[] for _ in range(FRAMES)]
    lines = ["HIERARCHY"]

    def write(bone: Bone, pad: str, frames: np.ndarray, joints: np.ndarray) -> None:
        root = not bone.parent
        moved = np.broadcast_to(np.array(bone.offset) / unit, (FRAMES, 3))
        turns = np.empty((FRAMES, 3, 3))
        for t in range(FRAMES):
            x, y, z = np.radians(_angles(meaning(bone.name), 2 * np.pi * t / FRAMES))
            local = turn(2, z) @ turn(0, x) @ turn(1, y)
            if extra and bone.name in extra:
                ex, ey, ez = np.radians(extra[bone.name])
                local = turn(2, ez) @ turn(0, ex) @ turn(1, ey) @ local
            if meaning(bone.name) == "Hips" and turned is not None:
                local = turned(t)
            turns[t] = axes @ local if root else local
            if root:
                joints[t] = axes @ (np.array([3.0, hips - _lift(bones), 2.0 * t]) / unit)
                rows[t] += joints[t].tolist()
            elif bone.six:
                rows[t] += [0.0, 0.0, 0.0] if zero else moved[t].tolist()
            rows[t] += np.degrees(zxy(turns[t])).tolist()
        places[bone.name] = joints if root else joints + np.einsum("tij,tj->ti", frames, moved)
        six = root or bone.six
        lines.append(f"{pad}{'ROOT' if root else 'JOINT'} {bone.name}")
        lines.append(pad + "{")
        lines.append(f"{pad}\tOFFSET " + " ".join(f"{x / unit:.9g}" for x in bone.offset))
        places_too = "6 Xposition Yposition Zposition" if six else "3"
        lines.append(f"{pad}\tCHANNELS {places_too} Zrotation Xrotation Yrotation")
        for child in children[bone.name]:
            write(child, pad + "\t", turns if root else frames @ turns, places[bone.name].copy())
        if bone.end is not None or not children[bone.name]:
            end = bone.end or (0.0, 0.0, 0.0)
            offset = " ".join(f"{x / unit:.9g}" for x in end)
            lines.extend([f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {offset}", f"{pad}\t}}"])
        lines.append(pad + "}")

    write(bones[0], "", np.broadcast_to(np.eye(3), (FRAMES, 3, 3)), np.zeros((FRAMES, 3)))
    motion = "\n".join(" ".join(f"{x:.6f}" for x in row) for row in rows)
    text = "\n".join([*lines, "MOTION", f"Frames: {FRAMES}", "Frame Time: 0.0333333", motion, ""])
    return text, places


def _lift(bones: tuple[Bone, ...]) -> float:
    """Height of the hips over the root, cm, which stands for it where the root is below them."""
    hips = next((bone for bone in bones[:3] if bone.parent and bone.offset[1] > 50), None)
    return 0.0 if hips is None else 90.5


def turn(axis: int, angle: float) -> np.ndarray:
    """Rotation (3, 3) about an axis."""
    matrix: np.ndarray = rotations.matrix(rotations.exp(angle * np.eye(3)[axis]))
    return matrix


def zxy(matrix: np.ndarray) -> np.ndarray:
    """Angles z, x, y of R = R_z R_x R_y."""
    return np.array(
        [
            np.arctan2(-matrix[0, 1], matrix[1, 1]),
            np.arcsin(np.clip(matrix[2, 1], -1.0, 1.0)),
            np.arctan2(-matrix[2, 0], matrix[2, 2]),
        ]
    )
