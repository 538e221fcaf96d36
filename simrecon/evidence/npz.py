"""Reader and writer of `simrecon.evidence/1`, one `.npz`; the table of its keys is in docs/formats.md."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.geometry import camera as cameras
from simrecon.io import atomic
from simrecon.io.arrays import Arrays, listed, load
from simrecon.types import Array, Camera, Evidence, Lens

SCHEMA = "simrecon.evidence/1"
FRAMES = ("world", "camera", "camera_root_relative")
KEYPOINT_KEYS = ("keypoint_names", "keypoints_px", "keypoint_scores")
JOINT_KEYS = ("joint_names", "joints_m", "joints_frame")
ROTATION_KEYS = ("rotation_names", "rotations")
GROUNDS = ("known", "unknown")
CAMERA_KEYS = ("camera_K", "camera_dist", "world_to_camera")
PERSON_KEYS = ("betas", "mass_kg", "height_m")
KEYS = (
    "schema", "times_s", "image_size_px",
    *KEYPOINT_KEYS, *CAMERA_KEYS, "ground", *JOINT_KEYS, *ROTATION_KEYS, *PERSON_KEYS,
)  # fmt: skip

# Bounds that only a wrong unit or a typing error crosses.
INTERVAL_RANGE_S = (0.0005, 0.5)
GAP_MAX_S = 60.0
EXTENT_MAX_M = 5.0
MASS_RANGE_KG = (5.0, 400.0)
HEIGHT_RANGE_M = (0.4, 2.8)
RIGID_TOLERANCE = 1e-4
UNIT_TOLERANCE = 1e-3


def read(path: str | os.PathLike[str]) -> Evidence:
    """Read and check `simrecon.evidence/1`.

    Landmarks that were not seen get NaN pixels and score 0; without `camera_dist` there is no distortion.

    Args:
        path: the `.npz`.

    Returns:
        The evidence; its names are not compared with the known ones, which is what `check_names` does.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    return parse(load(path))


def check(evidence: Evidence, source: str) -> Evidence:
    """Check evidence as a file of it would be.

    Args:
        evidence: of any origin.
        source: where it is from, for messages.

    Raises:
        InputError: evidence that `read` would refuse.
    """
    return parse(Arrays(source, _content(evidence)))


def write(path: str | os.PathLike[str], evidence: Evidence) -> None:
    """Check evidence and write it as `simrecon.evidence/1`; the target is replaced at once or left as it was.

    Args:
        path: the `.npz`, in an existing folder.
        evidence: what to write, less the parts that are empty or None. Same evidence, same bytes.

    Raises:
        InputError: evidence that `read` would refuse, or a target that can't be written.
    """
    content = _content(evidence)
    check(evidence, os.fspath(path))
    with atomic.reported(os.fspath(path)):
        atomic.write_npz(os.fspath(path), content)


def check_names(evidence: Evidence, valid: Collection[str], path: str | os.PathLike[str]) -> None:
    """Compare the names of 2D landmarks and 3D joints with the known ones.

    Args:
        evidence: read from `path`.
        valid: every name that the landmark table knows, in lower case; letter case does not matter.
        path: for the message.

    Raises:
        InputError: names the unknown ones and lists the valid ones.
    """
    for key, names in (("keypoint_names", evidence.keypoint_names), ("joint_names", evidence.joint_names)):
        if unknown := [name for name in names if name.lower() not in valid]:
            Arrays(os.fspath(path), {}).fail(key, f"unknown {listed(unknown)}", ", ".join(sorted(valid)))


def parse(arrays: Arrays) -> Evidence:
    """Check every key of `simrecon.evidence/1` and build the evidence (see `read`)."""
    arrays.text("schema", (SCHEMA,))
    if unknown := [key for key in arrays.content if key not in KEYS]:
        arrays.fail(listed(unknown), "an unknown key", ", ".join(KEYS))
    times = _times(arrays)
    evidence = Evidence(
        times_s=times, keypoint_names=(), keypoints_px=np.empty(0), scores=np.empty(0),
        joint_names=(), joints_m=np.empty(0), joints_frame=FRAMES[0],
        betas=arrays.finite("betas", ("S",)) if "betas" in arrays else None,
        mass_kg=arrays.scalar("mass_kg", MASS_RANGE_KG, "kg") if "mass_kg" in arrays else None,
        height_m=arrays.scalar("height_m", HEIGHT_RANGE_M, "m") if "height_m" in arrays else None,
        camera=_camera(arrays, len(times)),
        ground_known="ground" not in arrays or arrays.text("ground", GROUNDS) == "known",
        sha256=arrays.sha256,
    )  # fmt: skip
    evidence = _with_joints(arrays, _with_keypoints(arrays, evidence))
    if _has_rotations(arrays):
        evidence = replace(evidence, reading="rotations: in the file, not used")
    if not evidence.keypoint_names and not evidence.joint_names:
        groups = f"{', '.join(KEYPOINT_KEYS)} (2D landmarks) or {', '.join(JOINT_KEYS)} (3D joints), or both"
        arrays.fail("keypoints_px, joints_m", "neither", groups)
    if evidence.keypoint_names and evidence.camera is None:
        arrays.fail("camera_K", "2D landmarks without a camera", "camera_K (3, 3) beside keypoints_px")
    return evidence


def _times(arrays: Arrays) -> Array:
    times = arrays.finite("times_s", ("T",))
    if len(times) < 2:
        arrays.fail("times_s", "a single frame", "two frames or more")
    intervals = np.diff(times)
    if (intervals <= 0).any():
        i = int(np.argmax(intervals <= 0))
        arrays.fail("times_s", f"{times[i]:g} then {times[i + 1]:g} at frame {i + 1}", "increasing times")
    median = float(np.median(intervals))
    if not INTERVAL_RANGE_S[0] <= median <= INTERVAL_RANGE_S[1] or intervals.max() > GAP_MAX_S:
        found = f"a median interval of {median:g} s and a longest of {intervals.max():g} s"
        low, high = INTERVAL_RANGE_S
        valid = f"times in seconds, median interval {low:g} to {high:g}, no gap above {GAP_MAX_S:g}"
        arrays.fail("times_s", found, valid)
    return times


def _camera(arrays: Arrays, frames: int) -> Camera | None:
    size = arrays.finite("image_size_px", (2,)) if "image_size_px" in arrays else None
    if size is not None and ((size < 1).any() or (size != np.round(size)).any()):
        arrays.fail("image_size_px", str(size.tolist()), "width and height, whole numbers above 0")
    if not any(key in arrays for key in CAMERA_KEYS):
        return None
    matrix = arrays.finite("camera_K", (3, 3))
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        found = f"focal lengths {matrix[0, 0]:g} and {matrix[1, 1]:g}"
        arrays.fail("camera_K", found, "focal lengths above 0 px")
    off = matrix[[0, 1, 2, 2], [1, 0, 0, 1]]  # (4,) skew and the other entries that a pinhole has at 0
    if np.abs(off).max() > 1e-6 or abs(matrix[2, 2] - 1) > 1e-6:
        arrays.fail("camera_K", str(matrix.tolist()), "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels")
    if size is None:
        arrays.fail("image_size_px", "a camera without an image size", "width and height in pixels")
    distortion = arrays.finite("camera_dist", (5,)) if "camera_dist" in arrays else np.zeros(5)
    path = _path(arrays, "world_to_camera", frames) if "world_to_camera" in arrays else None
    return Camera(Lens(matrix, distortion, (int(size[0]), int(size[1]))), path)


def _path(arrays: Arrays, key: str, frames: int) -> Array:
    """Rigid transforms (T, 4, 4), of one for all frames (4, 4) or one for each."""
    moving = arrays.array(key).ndim == 3
    poses = arrays.finite(key, ("T", 4, 4) if moving else (4, 4)).reshape(-1, 4, 4)
    rotation = poses[:, :3, :3]
    determinants = np.linalg.det(rotation)
    errors = np.abs(np.swapaxes(rotation, 1, 2) @ rotation - np.eye(3)).max(axis=(1, 2))
    last_row_off = (poses[:, 3] != [0, 0, 0, 1]).any(axis=1)
    if (bad := (errors > RIGID_TOLERANCE) | (determinants < 0) | last_row_off).any():
        i = int(np.argmax(bad))
        where = f" in frame {i}" if moving else ""
        text = (
            f"det {determinants[i]:.4g}, off orthogonal by {errors[i]:.2g}, last row {poses[i, 3].tolist()}"
        )
        arrays.fail(key, text + where, "[[R, t], [0, 0, 0, 1]], R orthogonal with det 1, t in metres")
    return poses if moving else np.broadcast_to(poses, (frames, 4, 4))


def _given(arrays: Arrays, keys: tuple[str, ...]) -> bool:
    """Whether a group of keys is there; a part of it is an error."""
    there = [key for key in keys if key in arrays]
    if there and len(there) < len(keys):
        missing = [key for key in keys if key not in arrays]
        arrays.fail(listed(missing), f"no such key beside {listed(there)}", f"{', '.join(keys)} together")
    return bool(there)


def _points(arrays: Arrays, key: str, shape: tuple[int | str, ...]) -> Array:
    """Vectors in the last axis that are finite or NaN as a whole, and not NaN everywhere."""
    points = arrays.floats(key, shape)
    missing = np.isnan(points)
    if missing.all():
        arrays.fail(key, "NaN everywhere", "some finite values, or the keys of this group left out")
    if (missing.any(-1) != missing.all(-1)).any():
        frame = int(np.argwhere(missing.any(-1) != missing.all(-1))[0, 0])
        arrays.fail(key, f"a vector with some NaN at frame {frame}", "all its components finite, or all NaN")
    return points


def _with_keypoints(arrays: Arrays, evidence: Evidence) -> Evidence:
    frames = len(evidence.times_s)
    if not _given(arrays, KEYPOINT_KEYS):
        return replace(evidence, keypoints_px=np.empty((frames, 0, 2)), scores=np.empty((frames, 0)))
    names = arrays.names("keypoint_names", "J")
    points = _points(arrays, "keypoints_px", ("T", "J", 2))
    scores = arrays.floats("keypoint_scores", ("T", "J"))
    seen = ~np.isnan(points[..., 0])  # (T, J)
    if np.isnan(scores[seen]).any():
        arrays.fail("keypoint_scores", f"{int(np.isnan(scores[seen]).sum())} NaN at seen landmarks", "0 to 1")
    if (scores < 0).any() or (scores > 1).any():
        arrays.fail("keypoint_scores", f"{np.nanmin(scores):g} to {np.nanmax(scores):g}", "0 to 1")
    scores = np.where(seen, scores, 0.0)
    if not scores.any():
        arrays.fail("keypoint_scores", "0 at every seen landmark", "above 0 where a landmark was seen")
    return replace(evidence, keypoint_names=names, keypoints_px=points, scores=scores)


def _with_joints(arrays: Arrays, evidence: Evidence) -> Evidence:
    if not _given(arrays, JOINT_KEYS):
        return replace(evidence, joints_m=np.empty((len(evidence.times_s), 0, 3)))
    names = arrays.names("joint_names", "K")
    joints = _points(arrays, "joints_m", ("T", "K", 3))
    known = joints[~np.isnan(joints).any((1, 2))]
    extent = float(np.median(np.ptp(known, axis=1).max(-1))) if len(known) else 0.0
    if extent > EXTENT_MAX_M:
        arrays.fail("joints_m", f"a person {extent:g} across", f"metres, at most {EXTENT_MAX_M:g} m across")
    frame = arrays.text("joints_frame", FRAMES)
    return replace(evidence, joint_names=names, joints_m=joints, joints_frame=frame)


def _has_rotations(arrays: Arrays) -> bool:
    """Whether the file holds joint rotations, which are checked and left out."""
    if not _given(arrays, ROTATION_KEYS):
        return False
    arrays.names("rotation_names", "B")
    rotations = _points(arrays, "rotations", ("T", "B", 4))
    norms = np.linalg.norm(rotations, axis=-1, keepdims=True)  # (T, B, 1)
    if (np.abs(norms - 1) > UNIT_TOLERANCE).any():
        found = f"norms {np.nanmin(norms):g} to {np.nanmax(norms):g}"
        arrays.fail("rotations", found, "unit quaternions w x y z")
    return True


def _content(evidence: Evidence) -> dict[str, NDArray[Any]]:
    """The arrays of a file by key, without the parts that are empty or None."""
    content: dict[str, Any] = {"schema": SCHEMA, "times_s": evidence.times_s}
    if evidence.keypoint_names:
        values = (evidence.keypoint_names, evidence.keypoints_px, evidence.scores)
        content |= dict(zip(KEYPOINT_KEYS, values, strict=True))
    if evidence.joint_names:
        values3d = (evidence.joint_names, evidence.joints_m, evidence.joints_frame)
        content |= dict(zip(JOINT_KEYS, values3d, strict=True))
    if (camera := evidence.camera) is not None:
        lens, path = camera.lens, camera.path
        content |= {"image_size_px": lens.image_size_px, "camera_K": lens.matrix_px}
        content |= {"camera_dist": lens.distortion}
        content |= {"world_to_camera": path[0] if path is not None and cameras.is_still(camera) else path}
    if not evidence.ground_known:
        content["ground"] = "unknown"
    content |= {"betas": evidence.betas, "mass_kg": evidence.mass_kg, "height_m": evidence.height_m}
    return {key: np.asarray(value) for key, value in content.items() if value is not None}
