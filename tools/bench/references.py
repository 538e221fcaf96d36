"""Clean reference motions: DeepMimic's clips (MIT) on a body of their own segment lengths.

    fit = references.read(data / "mocap" / "deepmimic", "walk")

The file's axes are x forward, y up, z right, and its arms hang in the zero pose; a frame holds dt, the root's
position, and the rotations of root, chest, neck and, right side first, hip, knee, ankle, shoulder, elbow.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from simrecon import body as bodies
from simrecon import kinematics
from simrecon.geometry import rotations
from simrecon.types import Array, KinematicFit, Scene, Skeleton

CLIPS = ("walk", "run", "jump", "kick", "dance_a", "roll", "getup_faceup", "backflip")
HEIGHT_M, MASS_KG, RATE_HZ = 1.62, 45.0, 30.0
FLOOR_RANGE_M = 0.04
"""A sole this near to the file's floor stands; the floor is where such soles are in the median."""

_TO_WORLD = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
_SEGMENTS = (
    "root",
    "chest",
    "neck",
    *(f"{s}_{j}" for s in ("right", "left") for j in ("hip", "knee", "ankle", "shoulder", "elbow")),
)
_HINGES = ("knee", "elbow")


def read(folder: Path, clip: str) -> KinematicFit:
    """One clip at 30 Hz, standing on the floor; its camera is None."""
    times_s, root_m, local = _frames(json.loads((folder / f"humanoid3d_{clip}.txt").read_text())["Frames"])
    character = json.loads((folder / "humanoid3d.txt").read_text())
    foot = next(part for part in character["BodyDefs"] if part["Name"] == "left_ankle")
    skeleton = _skeleton(
        {j["Name"]: _TO_WORLD @ _along(j, "Attach") for j in character["Skeleton"]["Joints"]},
        _TO_WORLD @ _along(foot, "Attach"),
        np.abs(_TO_WORLD @ [foot[f"Param{i}"] for i in range(3)]),
    )
    qpos = np.concatenate((root_m, _rotations(skeleton, local).reshape(len(times_s), -1)), axis=1)
    grid = np.arange(0.0, times_s[-1] + 1e-9, 1.0 / RATE_HZ)
    moved = np.stack([np.interp(grid, times_s, column) for column in root_m.T], axis=1)
    turned = rotations.interpolate(times_s, qpos[:, 3:].reshape(len(times_s), -1, 4), grid)
    qpos = np.concatenate((moved, turned.reshape(len(grid), -1)), axis=1)
    body = bodies.build(skeleton, height_m=HEIGHT_M, mass_kg=MASS_KG)
    soles = [
        skeleton.point_names.index(f"{side}_{end}") for side in ("left", "right") for end in ("heel", "toe")
    ]
    lowest = kinematics.configurations(body, qpos)[1][:, soles, 2].min(axis=1)
    qpos[:, 2] -= np.median(lowest[np.abs(lowest) < FLOOR_RANGE_M])
    return KinematicFit(
        body=body,
        scene=Scene(),
        camera=None,
        times_s=grid,
        qpos=qpos,
        com_m=kinematics.configurations(body, qpos)[0],
        reprojection_px=np.full((len(grid), 0), np.nan),
        interpolated=np.zeros(len(grid), bool),
        iterations=0,
        loss={},
    )


def _frames(frames: list[list[float]]) -> tuple[Array, Array, dict[str, Array]]:
    """Times (T,), root (T, 3) in the world, local rotations (T, 4) by segment, still in the file's axes."""
    values = np.array(frames)
    times_s = np.concatenate(([0.0], np.cumsum(values[:-1, 0])))
    local, column = {}, 4
    for name in _SEGMENTS:
        if name.split("_")[-1] in _HINGES:
            local[name] = rotations.exp(values[:, column, None] * np.array([0.0, 0.0, 1.0]))
            column += 1
        else:
            local[name] = values[:, column : column + 4] / np.linalg.norm(
                values[:, column : column + 4], axis=1, keepdims=True
            )
            column += 4
    return times_s, values[:, 1:4] @ _TO_WORLD.T, local


def _along(entry: dict[str, float], key: str) -> Array:
    return np.array([entry[f"{key}{axis}"] for axis in "XYZ"])


def _skeleton(attach_m: dict[str, Array], foot_m: Array, foot_size_m: Array) -> Skeleton:
    """Our tree with the lengths and soles of the file; the trunk bends in two joints where the file has one.

    Args:
        attach_m: joint centres (3,) in their parents' frames.
        foot_m: (3,) centre of the foot's box, in the ankle's frame.
        foot_size_m: (3,) its full lengths.
    """
    unit = bodies.rescaled(bodies.template(), HEIGHT_M)
    offsets = unit.offsets_m.copy()
    row = {name: i for i, name in enumerate(unit.names)}
    share = unit.offsets_m[row["spine"], 2] / (unit.offsets_m[row["spine"]] + unit.offsets_m[row["chest"]])[2]
    offsets[row["spine"]], offsets[row["chest"]] = share * attach_m["chest"], (1 - share) * attach_m["chest"]
    offsets[row["neck"]] = attach_m["neck"]
    for side in ("left", "right"):
        for name in ("hip", "knee", "ankle", "shoulder"):
            offsets[row[f"{side}_{name}"]] = attach_m[f"{side}_{name}"]
        for name in ("elbow", "wrist"):
            along = np.sign(unit.offsets_m[row[f"{side}_{name}"], 1]) * np.array([0.0, 1.0, 0.0])
            offsets[row[f"{side}_{name}"]] = along * np.linalg.norm(attach_m[f"{side}_{name}"])
    points = unit.point_offsets_m.copy()
    for side in ("left", "right"):
        for end, forward in (("heel", -0.5), ("toe", 0.5)):
            points[unit.point_names.index(f"{side}_{end}")] = foot_m + foot_size_m * [forward, 0.0, -0.5]
    return replace(unit, offsets_m=offsets, point_offsets_m=points)


def _rotations(skeleton: Skeleton, local: dict[str, Array]) -> Array:
    """Root and joint quaternions (T, 17, 4), joints counted from our rest pose."""
    count = len(local["root"])
    turn = _quaternion(_TO_WORLD)
    turned = {
        name: rotations.multiply(rotations.multiply(turn, q), rotations.conjugate(turn))
        for name, q in local.items()
    }
    identity = np.tile([1.0, 0, 0, 0], (count, 1))
    half = rotations.slerp(identity, turned["chest"], np.full(count, 0.5))
    ours = {"pelvis": turned["root"], "spine": half, "chest": half, "neck": turned["neck"]}
    for side, sign in (("left", -1.0), ("right", 1.0)):
        ours |= {f"{side}_{name}": turned[f"{side}_{name}"] for name in ("hip", "knee", "ankle")}
        hang = np.tile(rotations.exp(np.array([sign * np.pi / 2, 0.0, 0.0])), (count, 1))
        ours[f"{side}_shoulder"] = rotations.multiply(turned[f"{side}_shoulder"], hang)
        ours[f"{side}_elbow"] = rotations.multiply(
            rotations.multiply(rotations.conjugate(hang), turned[f"{side}_elbow"]), hang
        )
    rest = rotations.conjugate(skeleton.rest)
    stack = [
        rotations.multiply(np.tile(rest[i], (count, 1)), ours.get(name, identity))
        for i, name in enumerate(skeleton.names)
    ]
    return rotations.canonical(np.stack(stack, axis=1))


def _quaternion(matrix: Array) -> Array:
    return rotations.from_matrix(matrix)
