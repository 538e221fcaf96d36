"""TRAM: `hps_track_k.npy` of a person, with `camera.npy` beside its folder.

Poses are in the frame of each image's camera; `pred_cam_R`, `pred_cam_T` bring them to the frame of the first
camera, and `world_cam_R`, `world_cam_T`, where they are, to a world that is aligned with gravity; these
are the path of a camera that moves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from simrecon.evidence.content import Content, open_content
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import carried
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.smpl.motion import SmplMotion
from simrecon.evidence.values import branch
from simrecon.io.arrays import Arrays
from simrecon.io.messages import counted
from simrecon.types import Camera, Evidence

STILL_M, STILL_RAD = 0.05, np.radians(2.0)


def matches(content: Content) -> bool:
    """Whether the file is of this kind."""
    return isinstance(content.tree, Mapping) and "pred_rotmat" in content.tree


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the person of one track."""
    arrays = branch(content, content.tree, "")
    rotations = smpl.pose_matrices(arrays, "pred_rotmat", 24)
    numbers = np.arange(len(rotations), dtype=float)
    if "frame" in arrays:
        numbers = smpl.check_frames(content, "frame", arrays.finite("frame", ("T",)))
    motion = SmplMotion(
        model="smpl",
        frame="camera",
        times_s=times_s(content.source, numbers, options.rate_hz),
        rotations=rotations,
        trans_m=smpl.translation(arrays, "pred_trans"),
    )
    beside = [content.path.parent / "camera.npy", content.path.parent.parent / "camera.npy"]
    place = next((path for path in beside if path.is_file()), None)
    if place is None:
        if options.frame == "world":
            raise content.fail("camera.npy", "none beside the file or its folder", "--frame camera")
        note = "no camera.npy beside it: frame of each image's camera"
        return smpl.to_evidence(content, motion, options, camera=_lens(arrays, options), notes=note)
    camera = open_content(place)
    return _with_camera(content, motion, options, branch(camera, camera.tree, ""), numbers.astype(int))


def _with_camera(
    content: Content,
    seen: SmplMotion,
    options: Options,
    camera: Arrays,
    numbers: np.ndarray[tuple[int], np.dtype[np.int64]],
) -> Evidence:
    world = options.frame != "camera" and "world_cam_R" in camera
    if options.frame == "world" and not world:
        camera.fail("world_cam_R", "no such key", "--frame camera: this file knows no world")
    prefix = "world_cam" if world else "pred_cam"
    rotation, place = camera.finite(f"{prefix}_R", ("N", 3, 3)), camera.finite(f"{prefix}_T", ("N", 3))
    if numbers.max() >= len(rotation):
        camera.fail(
            f"{prefix}_R",
            f"{counted(len(rotation), 'frame')}",
            f"{counted(int(numbers.max()) + 1, 'frame')} or more",
        )
    turn = np.abs(rotation[numbers] - rotation[numbers[:1]]).max()
    still = turn < STILL_RAD and np.linalg.norm(place[numbers] - place[numbers[:1]], axis=-1).max() < STILL_M
    motion = smpl.in_first_camera(seen, rotation[numbers], place[numbers])
    if world:
        motion = replace(motion, frame="world")
    lens, path, note = _lens(camera, options), None, "the camera stands still"
    if still and world:
        path, where = carried.at_rest(rotation[numbers], place[numbers], motion, lens, options)
        note = ", ".join(filter(None, (note, where)))
    if not still:
        path = carried.along(rotation[numbers], place[numbers])
        reason = carried.fault(path, motion) if world else carried.FIRST_FRAME
        lens, path, note = carried.choose(lens, path, "the camera moves", reason)
    notes = f"camera.npy: {note}" if note else ""
    return smpl.to_evidence(content, motion, options, camera=lens, path=path, notes=notes)


def _lens(arrays: Arrays, options: Options) -> Camera | None:
    if options.camera is not None or "img_focal" not in arrays or "img_center" not in arrays:
        return options.camera
    focal = float(
        np.median(
            Arrays(arrays.source, {"img_focal": arrays.array("img_focal").reshape(-1)}).finite(
                "img_focal", ("F",)
            )
        )
    )
    centre = Arrays(arrays.source, {"img_center": arrays.array("img_center").reshape(-1)[-2:]}).finite(
        "img_center", (2,)
    )
    return smpl.lens(focal, centre)
