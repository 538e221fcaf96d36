"""Evidence made in memory, with the checks that evidence from files passes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrecon.body import names
from simrecon.errors import InputError
from simrecon.evidence.npz import check, check_names
from simrecon.types import Array, Camera, Evidence

SOURCE = "evidence from arrays"


def from_arrays(
    times_s: Array,
    *,
    keypoint_names: Sequence[str] = (),
    keypoints_px: Array | None = None,
    scores: Array | None = None,
    joint_names: Sequence[str] = (),
    joints_m: Array | None = None,
    joints_frame: str = "world",
    camera: Camera | None = None,
    height_m: float | None = None,
    mass_kg: float | None = None,
    trust: str = "",
) -> Evidence:
    """Evidence of one person; 2D landmarks, a 3D estimate, or both.

    Args:
        times_s: (T,) increasing.
        keypoint_names: J names of 2D landmarks.
        keypoints_px: (T, J, 2) pixels, NaN = not seen; needs a camera.
        scores: (T, J) in [0, 1]; 1 where a landmark is seen if None.
        joint_names: K names of the 3D estimate.
        joints_m: (T, K, 3) metres, NaN = unknown.
        joints_frame: `world` (z up), `camera` (x right, y down, z forward) or `camera_root_relative`.
        camera: the lens, and its path where it is known.
        height_m: of the person, if known.
        mass_kg: of the person, if known.
        trust: how far the 3D estimate is to be trusted, such as `mocap`; as `joints_frame` deserves if empty.

    Raises:
        InputError: shapes that do not fit, values that are not finite, or unknown names.
    """
    for points, names_given, key in (
        (keypoints_px, keypoint_names, "keypoint_names"),
        (joints_m, joint_names, "joint_names"),
    ):
        if points is not None and not len(names_given):
            raise InputError(
                f"{SOURCE}: {key}: found no names for the points beside them; valid: one for each"
            )
    frames = len(times_s)
    pixels = np.empty((frames, 0, 2)) if keypoints_px is None else np.asarray(keypoints_px, float)
    if scores is None:
        scores = np.isfinite(pixels).all(axis=-1).astype(float)
    evidence = Evidence(
        times_s=np.asarray(times_s, float),
        keypoint_names=tuple(keypoint_names),
        keypoints_px=pixels,
        scores=np.asarray(scores, float),
        joint_names=tuple(joint_names),
        joints_m=np.empty((frames, 0, 3)) if joints_m is None else np.asarray(joints_m, float),
        joints_frame=joints_frame,
        height_m=height_m,
        mass_kg=mass_kg,
        camera=camera,
        trust=trust,
    )
    checked = check(evidence, SOURCE)
    check_names(checked, names.valid_names(), SOURCE)
    return checked
