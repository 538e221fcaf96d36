"""The kinematic half of a finished result, read back to go on from it."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from simrecon import kinematics
from simrecon.errors import InputError
from simrecon.evidence import resample
from simrecon.geometry import rotations
from simrecon.io.reading import read_bytes
from simrecon.results import folder as folders
from simrecon.results import report_file
from simrecon.results.view import open_result
from simrecon.types import Array, Body, Evidence, IntArray, KinematicFit, Report


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
    result, path = open_result(folder), Path(folder)
    motion, report, body = result.motion, result.report, result.body
    if motion.kinematic_qpos is None:
        raise InputError(
            f"{path / folders.MOTION}: kinematic_qpos: found none; valid: a result that holds it"
        )
    on_grid, grid = uniform(motion.times_s)
    bare = replace(
        _clock(motion.times_s),
        sha256=hashlib.sha256(read_bytes(path / folders.MOTION)).hexdigest(),
        reading=f"kinematic motion of {folder}",
    )
    interpolated = np.zeros(len(on_grid.times_s), dtype=np.bool_)
    interpolated[grid[_out_of_view(report, path, len(motion.times_s))]] = True
    qpos = on_clock(motion.times_s, motion.kinematic_qpos[:, : coordinates(body)], on_grid.times_s)
    return bare, KinematicFit(
        body=body,
        scene=result.scene,
        camera=None,
        times_s=on_grid.times_s,
        qpos=qpos,
        com_m=kinematics.configurations(body, qpos)[0],
        reprojection_px=np.empty((len(on_grid.times_s), 0)),
        interpolated=interpolated,
        iterations=0,
        loss={},
    )


def _out_of_view(report: Report, folder: Path, count: int) -> list[int]:
    """The frames in which the person was out of view, of so many."""
    path = folder / folders.REPORT
    rows = list(report_file.frames(report, path).interpolated_frames)
    if rows and max(rows) >= count:
        raise InputError(f"{path}: [frames] interpolated_frames: found {max(rows)}; valid: below {count}")
    return rows


def coordinates(body: Body) -> int:
    """How many numbers of `qpos` are the person's: place of the root, then 17 quaternions."""
    return 3 + 4 * len(body.skeleton.names)


def uniform(times_s: Array) -> tuple[Evidence, IntArray]:
    """A uniform clock for times (T,): evidence of nothing but G times, and (T,) the nearest of them."""
    return resample(_clock(times_s))


def _clock(times_s: Array) -> Evidence:
    return Evidence(
        times_s=times_s,
        keypoint_names=(),
        keypoints_px=np.empty((len(times_s), 0, 2)),
        scores=np.empty((len(times_s), 0)),
        joint_names=(),
        joints_m=np.empty((len(times_s), 0, 3)),
        joints_frame="world",
    )


def on_clock(times_s: Array, qpos: Array, at_s: Array) -> Array:
    """Configurations (T, nq) at other times (G,): the root's place linearly, rotations by slerp."""
    quats = rotations.interpolate(times_s, qpos[:, 3:].reshape(len(qpos), -1, 4), at_s)
    place = _columns(times_s, qpos[:, :3], at_s)
    return np.concatenate((place, quats.reshape(len(at_s), -1)), axis=1)


def _columns(times_s: Array, values: Array, at_s: Array) -> Array:
    """Linear interpolation of each column of (T, C)."""
    return np.stack([np.interp(at_s, times_s, column) for column in values.T], axis=1)
