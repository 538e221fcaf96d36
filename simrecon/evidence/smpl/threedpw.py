"""3DPW, `sequenceFiles/*/*.pkl`: joints in space and in the image, and the path of the phone that saw them.

By person `jointPositions` (T, 72), the joints of SMPL of that person's shape, and `poses2d` (T, 3, 18) in the
order of OpenPose's 18; for all `cam_poses` (T, 4, 4), world to camera, and `cam_intrinsics`. 30 Hz, aligned
with the images (the data set's readme; von Marcard et al. 2018).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from simrecon.evidence import people
from simrecon.evidence.axes import find_up, to_z_up
from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import layouts
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.values import as_array, branch
from simrecon.geometry import camera as cameras
from simrecon.io.arrays import Arrays
from simrecon.io.messages import counted
from simrecon.types import Array, Camera, Evidence, Lens

RATE_HZ = 30.0
TRUST = "mocap,joints_m=0.03,place_m=0.03,assume=0.1"
"""Inertial sensors and video together: 26 mm on average (von Marcard et al. 2018, table 1)."""
JOINTS = 24


def matches(content: Content) -> bool:
    """Whether the file is a sequence of 3DPW."""
    tree = content.tree if content.kind == "pickle" else None
    return isinstance(tree, Mapping) and "jointPositions" in tree and "cam_poses" in tree


def read(content: Content, options: Options) -> Evidence:
    """Evidence of one person of a sequence."""
    tracks = _list(content, "jointPositions")
    frames = {str(i): int(np.shape(track)[0]) if np.ndim(track) else 0 for i, track in enumerate(tracks)}
    person = people.choose(content, frames, options.person)
    arrays = _of(content, int(person))
    joints = arrays.finite("jointPositions", ("T", 3 * JOINTS)).reshape(-1, JOINTS, 3)
    names = smpl.names()
    ankles = [names.index(f"{side}_ankle") for side in ("left", "right")]
    upright = joints[:, names.index("neck")] - joints[:, ankles].mean(axis=1)
    axis, how = find_up(content.source, upright, options.up)
    turn = to_z_up(axis)
    known = arrays.array("campose_valid").reshape(-1).astype(bool)
    camera, path_note = _camera(arrays, options, turn)
    points, scores = _landmarks(arrays, known)
    notes = (
        people.named(frames, person), f"up {axis} ({how})", f"{RATE_HZ:g} Hz", path_note,
        "joints and landmarks of the data set; shape parameters and clothes are not used",
    )  # fmt: skip
    return Evidence(
        times_s=times_s(content.source, np.arange(len(joints)), options.fps or RATE_HZ),
        keypoint_names=layouts.layout("openpose_18"),
        keypoints_px=points,
        scores=scores,
        joint_names=names,
        joints_m=joints @ turn.T,
        joints_frame="world",
        camera=camera,
        ground_known=False,
        trust=TRUST,
        sha256=content.sha256,
        reading="; ".join(note for note in notes if note),
    )


def _list(content: Content, key: str) -> Sequence[Any]:
    listed = content.tree.get(key)
    if not isinstance(listed, (list, tuple)):
        raise content.fail(key, f"a {type(listed).__name__}", "a list of people")
    return listed


def _of(content: Content, person: int) -> Arrays:
    """The arrays of one person, and those of all."""
    whole = branch(content, {key: content.tree.get(key) for key in ("cam_poses", "cam_intrinsics")}, "")
    own = {}
    for key in ("jointPositions", "poses2d", "campose_valid"):
        listed = _list(content, key)
        value = as_array(listed[person]) if person < len(listed) else None
        if value is None:
            raise content.fail(f"{key}[{person}]", "no array", "one for each person")
        own[key] = value
    return Arrays(content.source, {**whole.content, **own}, content.sha256)


def _camera(arrays: Arrays, options: Options, turn: Array) -> tuple[Camera, str]:
    """The lens of the file, or the user's, on the file's path in a world with z up."""
    path = arrays.finite("cam_poses", ("T", 4, 4)).copy()
    off = np.abs(np.swapaxes(path[:, :3, :3], 1, 2) @ path[:, :3, :3] - np.eye(3)).max()
    if off > 1e-2:
        arrays.fail("cam_poses", f"rotations off orthogonal by {off:.2g}", "transforms from world to camera")
    path[:, :3, :3] = path[:, :3, :3] @ turn.T
    if options.camera is not None:
        return Camera(options.camera.lens, path), "the camera's path as the file has it"
    matrix = arrays.finite("cam_intrinsics", (3, 3))
    size = (round(2 * float(matrix[0, 2])), round(2 * float(matrix[1, 2])))
    if min(matrix[0, 0], matrix[1, 1], *size) <= 0:
        arrays.fail("cam_intrinsics", str(matrix.tolist()), "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels")
    lens = Lens(np.diag([matrix[0, 0], matrix[1, 1], 1.0]), np.zeros(5), size)
    lens.matrix_px[:2, 2] = matrix[:2, 2]
    note = f"lens and path of the camera as the file has them, focal length {cameras.focal_px(lens):.0f} px"
    return Camera(lens, path), note


def _landmarks(arrays: Arrays, known: Array) -> tuple[Array, Array]:
    """Landmarks (T, 18, 2) and scores (T, 18), unseen where the camera's pose is not that of the image."""
    values = np.swapaxes(arrays.finite("poses2d", ("T", 3, 18)), 1, 2)  # (T, 18, 3)
    if len(known) != len(values):
        arrays.fail(
            "campose_valid",
            f"{counted(len(known), 'value')} for {counted(len(values), 'frame')}",
            "one for each frame",
        )
    scores = np.clip(np.where(known[:, None], values[..., 2], 0.0), 0.0, 1.0)
    return np.where((scores > 0)[..., None], values[..., :2], np.nan), scores
