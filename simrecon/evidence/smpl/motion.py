"""A motion of an SMPL or SMPL-X body, and the evidence it makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from simrecon import resources
from simrecon.evidence.axes import find_up, to_z_up
from simrecon.evidence.content import Content
from simrecon.evidence.options import Options
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.io.arrays import Arrays
from simrecon.types import Array, Camera, Evidence, Lens

# Joints that a body has without its hands, by model; SMPL counts a hand joint on each side.
BODY_JOINTS = {"smpl": 24, "smplx": 22}


UNNAMED = ("neck2",)
"""Joints that are no point of our body."""
JOINTS_READING = "joints of the average body, without the twist of their bones"


@dataclass(frozen=True, eq=False)
class SmplMotion:
    """Pose parameters of one person.

    Attributes:
        model: `smpl`, `smplx` or `soma`.
        frame: `world` or `camera`.
        times_s: (T,).
        rotations: (T, B, 4) of the joints in their parents, the root's in `frame`; those of `names(model)`,
            or the first of them.
        trans_m: (T, 3) translation, in `frame`.
    """

    model: str
    frame: str
    times_s: Array
    rotations: Array
    trans_m: Array


def names(model: str = "smpl") -> tuple[str, ...]:
    """Joints of a model: the 24 of SMPL, of which SMPL-X shares the first 22, or SOMA's without fingers."""
    return tuple(_tree(model)["names"])


def parents() -> tuple[int, ...]:
    """Parents of SMPL's 24 joints, -1 for the first."""
    return tuple(_tree("smpl")["parents"])


@cache
def _tree(model: str) -> Mapping[str, Any]:
    """Names and parents of a model's joints."""
    table: Mapping[str, Any] = resources.toml("models", "body", "smpl.toml")
    return table[model] if model == "soma" else table


def soma_numbers() -> tuple[int, ...]:
    """Which of SOMA's 77 joints are those of `names("soma")`."""
    return tuple(_tree("soma")["numbers"])


@cache
def offsets_m(model: str) -> Array:
    """Joint centres of the average body (B, 3) in their parents' frames, the pelvis' in that of the body."""
    table = resources.toml("models", "body", "smpl.toml")[model]
    rows = []
    for name in names(model):
        row = np.array(table[name.replace("right_", "left_", 1)], float)
        rows.append(row * [-1.0, 1.0, 1.0] if name.startswith("right_") else row)
    return np.array(rows)


def joints_m(motion: SmplMotion) -> Array:
    """Joint centres (T, B, 3) of the average body in a motion's poses, in its frame.

    With G_b the rotation of joint b in the frame and o_b its offset, x_b = x_parent + G_parent o_b; the root
    turns about the pelvis: x_0 = o_0 + translation (Loper et al. 2015).
    """
    offset, before = offsets_m(motion.model), _tree(motion.model)["parents"]
    places = np.empty((*motion.rotations.shape[:2], 3))
    turned = np.empty_like(motion.rotations)
    places[:, 0] = offset[0] + motion.trans_m
    turned[:, 0] = motion.rotations[:, 0]
    for joint in range(1, motion.rotations.shape[1]):
        parent = before[joint]
        places[:, joint] = places[:, parent] + rotations.rotate(turned[:, parent], offset[joint])
        turned[:, joint] = rotations.multiply(turned[:, parent], motion.rotations[:, joint])
    return places


def to_evidence(
    content: Content,
    motion: SmplMotion,
    options: Options,
    *,
    up: str | None = None,
    camera: Camera | None = None,
    path: Array | None = None,
    notes: str = "",
) -> Evidence:
    """Evidence of a motion, in a world with z up, or in the camera's frame.

    Args:
        content: the file.
        motion: of one person.
        options: of the user; `up` there takes precedence.
        up: axis that points up in the world of this kind of file; None = found from the body.
        camera: the lens, where the file gives it.
        path: (T, 4, 4) of the camera in the file's world, where it moves; of no use without a lens.
        notes: on how the file was read.
    """
    places = joints_m(motion)
    reading = f"{motion.model.upper().replace('SMPLX', 'SMPL-X')} parameters, frame {motion.frame}"
    if motion.frame == "world":
        if up is not None and options.up is None:
            axis, how = up, "this format's convention"
        else:
            upright = _upright(motion.model, places)
            axis, how = find_up(content.source, upright, options.up)
        turn = to_z_up(axis)
        places = places @ turn.T
        if camera is not None and path is not None:
            turned = path.copy()
            turned[:, :3, :3] = path[:, :3, :3] @ turn.T
            camera = cameras.with_path(camera, turned)
        reading += f", up {axis} ({how})"
    count = motion.rotations.shape[1]
    kept = [i for i, name in enumerate(names(motion.model)[:count]) if name not in UNNAMED]
    return Evidence(
        times_s=motion.times_s,
        keypoint_names=(),
        keypoints_px=np.empty((len(places), 0, 2)),
        scores=np.empty((len(places), 0)),
        joint_names=tuple(names(motion.model)[i] for i in kept),
        joints_m=places[:, kept],
        joints_frame=motion.frame,
        camera=camera,
        ground_known=camera is None or path is None,
        sha256=content.sha256,
        reading="; ".join(part for part in (reading, JOINTS_READING, notes) if part),
    )


def _upright(model: str, places: Array) -> Array:
    """From the ankles to the neck (T, 3)."""
    neck, left, right = (names(model).index(name) for name in ("neck", "left_ankle", "right_ankle"))
    upright: Array = places[:, neck] - (places[:, left] + places[:, right]) / 2
    return upright


def pose_vectors(arrays: Arrays, key: str, joints: int) -> Array:
    """Rotation vectors as quaternions (T, joints, 4); the array is (T, 3 joints) or (T, joints, 3).

    More joints than asked for, such as those of the fingers, are left out.
    """
    values = arrays.array(key)
    width = int(np.prod(values.shape[1:]))
    if values.ndim not in (2, 3) or width % 3 or width < 3 * joints or values.shape[-1] not in (3, width):
        valid = f"shape (T, {3 * joints}) or (T, {joints}, 3), or more joints"
        arrays.fail(key, f"shape {values.shape}", valid)
    flat = arrays.finite(key, ("T", *values.shape[1:])).reshape(len(values), -1)
    return rotations.exp(flat[:, : 3 * joints].reshape(len(flat), joints, 3))


def pose_matrices(arrays: Arrays, key: str, joints: int) -> Array:
    """Rotation matrices as quaternions (T, joints, 4); the array is (T, joints, 3, 3)."""
    values = arrays.finite(key, ("T", joints, 3, 3))
    off = np.abs(np.swapaxes(values, -1, -2) @ values - np.eye(3)).max()
    if off > 1e-2 or (np.linalg.det(values) < 0).any():
        arrays.fail(key, f"matrices off orthogonal by {off:.2g}", "rotation matrices")
    return rotations.from_matrix(values)


def translation(arrays: Arrays, key: str) -> Array:
    """A translation (T, 3); the array may have axes of one more."""
    values = arrays.array(key)
    squeezed = values.reshape(len(values), -1) if values.ndim > 2 else values
    return Arrays(arrays.source, {key: squeezed}, arrays.sha256, arrays._sizes).finite(key, ("T", 3))


def check_frames(content: Content, key: str, frames: Array) -> Array:
    """Frame numbers (T,), increasing."""
    if (np.diff(frames) <= 0).any():
        at = int(np.argmax(np.diff(frames) <= 0))
        raise content.fail(key, f"{frames[at]:g} then {frames[at + 1]:g}", "increasing frame numbers")
    return frames


def lens(focal_px: float, centre_px: Array) -> Camera:
    """A camera whose principal point is the middle of its image, as these networks assume."""
    matrix = np.array([[focal_px, 0.0, centre_px[0]], [0.0, focal_px, centre_px[1]], [0.0, 0.0, 1.0]])
    size = (round(2 * float(centre_px[0])), round(2 * float(centre_px[1])))
    return Camera(Lens(matrix, np.zeros(5), size))


def in_first_camera(motion: SmplMotion, camera_rotations: Array, camera_places: Array) -> SmplMotion:
    """A motion given in a moving camera's frame, in the frame that its camera poses are given in.

    Args:
        motion: in the frame of each frame's camera.
        camera_rotations: (T, 3, 3) camera to world.
        camera_places: (T, 3) of the camera.
    """
    pelvis = offsets_m(motion.model)[0]
    place = (camera_rotations @ (motion.trans_m + pelvis)[..., None])[..., 0] + camera_places
    root = rotations.multiply(rotations.from_matrix(camera_rotations), motion.rotations[:, 0])
    turned = np.concatenate((root[:, None], motion.rotations[:, 1:]), axis=1)
    return replace(motion, rotations=turned, trans_m=place - pelvis)
