"""Two files of one clip as one evidence: the 3D estimate of the first, the 2D landmarks of the second."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np

from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.types import Camera, Evidence

NO_LENS = (
    "landmarks in an image, but no lens; valid: --fov DEGREES and --size WIDTHxHEIGHT, "
    "or --keypoints of a file with one"
)
OVERLAP_MIN = 0.5
OWN = "simrecon evidence"


def join(
    first: Evidence,
    second: Evidence,
    path: str | os.PathLike[str],
    keypoints: str | os.PathLike[str],
) -> Evidence:
    """The first evidence with the 2D landmarks of the second, at the first one's times.

    Args:
        first: with a 3D estimate.
        second: with 2D landmarks; a frame goes with the first one's nearest within half an interval.
        path: of the first, for messages.
        keypoints: path of the second.

    Raises:
        InputError: one has nothing to give, or they have hardly a frame in common.
    """
    if not second.keypoint_names:
        raise InputError(f"{os.fspath(keypoints)}: found no 2D landmarks; valid: a file with them")
    if not first.joint_names:
        raise InputError(f"{os.fspath(path)}: found no 3D estimate; valid: one, to go with --keypoints")
    if first.camera is None and second.camera is None:
        raise InputError(
            f"{os.fspath(path)}: found {NO_LENS.replace(', or --keypoints of a file with one', '')}"
        )
    interval = float(np.median(np.diff(first.times_s))) if len(first.times_s) > 1 else np.inf
    right = np.clip(np.searchsorted(second.times_s, first.times_s), 1, max(len(second.times_s) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(second.times_s) - 1)
    nearer = np.abs(second.times_s[left] - first.times_s) <= np.abs(second.times_s[right] - first.times_s)
    nearest = np.where(nearer, left, right)
    near = np.abs(second.times_s[nearest] - first.times_s) <= 0.5 * interval  # (T,)
    if near.mean() < OVERLAP_MIN:
        overlap = f"landmarks for {int(near.sum())} of the {len(near)} frames of {os.fspath(path)}"
        raise InputError(
            f"{os.fspath(keypoints)}: found {overlap}; valid: both of the same video, at one --fps"
        )
    camera = first.camera
    if camera is None and second.camera is not None:
        camera = cameras.at(second.camera, nearest)
        if not second.ground_known:  # a path in another world than that of the 3D estimate
            camera = Camera(camera.lens)
    return replace(
        first,
        keypoint_names=second.keypoint_names,
        keypoints_px=np.where(near[:, None, None], second.keypoints_px[nearest], np.nan),
        scores=np.where(near[:, None], second.scores[nearest], 0.0),
        camera=camera,
        reading="\n".join(
            (
                first.reading or OWN,
                f"{second.reading or OWN}, for {int(near.sum())} of {len(near)} frames",
            )
        ),
    )
