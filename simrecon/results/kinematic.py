"""The kinematic half of a finished result, read back to go on from it."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from simrecon import rotations
from simrecon import scene as scenes
from simrecon.body import known
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.results import folder as folders
from simrecon.types import Array, Evidence, KinematicFit


def read(folder: Path | str) -> tuple[Evidence, KinematicFit]:
    """What a result's simulation was to follow.

    The motion stands for itself: the evidence it was fitted to, and the camera, are left behind.

    Args:
        folder: of a result.

    Returns:
        Evidence that holds nothing but the result's times, and the fit on its uniform clock.

    Raises:
        InputError: it is no result folder, or one without its kinematic fit.
    """
    motion, report, path = folders.read(folder), folders.read_report(folder), Path(folder)
    if motion.kinematic_qpos is None:
        raise InputError(
            f"{path / folders.MOTION}: kinematic_qpos: found none; valid: a result that holds it"
        )
    try:
        body = known.of_mjcf((path / folders.MODEL).read_text(encoding="utf-8"), report["person"]["height_m"])
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path / folders.MODEL}: can't be read ({error})") from error
    bare = Evidence(
        times_s=motion.times_s,
        keypoint_names=(),
        keypoints_px=np.empty((len(motion.times_s), 0, 2)),
        scores=np.empty((len(motion.times_s), 0)),
        joint_names=(),
        joints_m=np.empty((len(motion.times_s), 0, 3)),
        joints_frame="world",
        sha256=hashlib.sha256((path / folders.MOTION).read_bytes()).hexdigest(),
        reading=f"kinematic motion of {folder}",
    )
    uniform, grid = resample(bare)
    own = 7 + 4 * (len(body.skeleton.names) - 1)
    interpolated = np.zeros(len(uniform.times_s), dtype=np.bool_)
    interpolated[grid[report.get("frames", {}).get("interpolated_frames", [])]] = True
    return bare, KinematicFit(
        body=body,
        scene=scenes.read(path / folders.SCENE),
        camera=None,
        times_s=uniform.times_s,
        qpos=_on_clock(motion.times_s, motion.kinematic_qpos[:, :own], uniform.times_s),
        com_m=_columns(motion.times_s, motion.com_m, uniform.times_s),
        reprojection_px=np.empty((len(uniform.times_s), 0)),
        interpolated=interpolated,
        iterations=0,
        loss={},
    )


def _on_clock(times_s: Array, qpos: Array, at_s: Array) -> Array:
    """Configurations (T, nq) at other times (G,): the root's place linearly, rotations by slerp."""
    quats = rotations.interpolate(times_s, qpos[:, 3:].reshape(len(qpos), -1, 4), at_s)
    place = _columns(times_s, qpos[:, :3], at_s)
    return np.concatenate((place, quats.reshape(len(at_s), -1)), axis=1)


def _columns(times_s: Array, values: Array, at_s: Array) -> Array:
    """Linear interpolation of each column of (T, C)."""
    return np.stack([np.interp(at_s, times_s, column) for column in values.T], axis=1)
