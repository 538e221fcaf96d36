"""The keys of `simrecon.evidence/1` by group, with the checks of each; the table is in docs/formats.md."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import body as bodies
from simrecon.evidence import ranges
from simrecon.io.arrays import Arrays, listed
from simrecon.io.messages import counted
from simrecon.types import Array, Camera, Evidence, Lens, Part

FRAMES = ("world", "camera", "camera_root_relative")
KEYPOINTS = ("keypoint_names", "keypoints_px", "keypoint_scores")
JOINTS = ("joint_names", "joints_m", "joints_frame")
ROTATIONS = ("rotation_names", "rotations")
PART = "source_frames"
GROUNDS = ("known", "unknown")
CAMERA = ("camera_K", "camera_dist", "world_to_camera")
LENGTHS = ("length_names", "lengths_m")
PERSON = ("betas", "mass_kg", "height_m", *LENGTHS)
ALL = (
    "schema", "times_s", PART, "image_size_px", "focal_sigma",
    *KEYPOINTS, *CAMERA, "ground", "trust", *JOINTS, *ROTATIONS, *PERSON,
)  # fmt: skip

FOCAL_SIGMA = (0.0, 1.0)
# Bounds that only a wrong unit or a typing error crosses.
INTERVAL_RANGE_S = (0.0005, 0.5)
GAP_MAX_S = 60.0
EXTENT_MAX_M = 5.0
MASS_RANGE_KG = (5.0, 400.0)
HEIGHT_RANGE_M = (0.4, 2.8)
RIGID_TOLERANCE = 1e-4
UNIT_TOLERANCE = 1e-3


def times(arrays: Arrays) -> Array:
    """Increasing times (T,), s."""
    values = arrays.finite("times_s", ("T",))
    if len(values) < 2:
        arrays.fail("times_s", "a single frame", "two frames or more")
    intervals = np.diff(values)
    if (intervals <= 0).any():
        i = int(np.argmax(intervals <= 0))
        arrays.fail("times_s", f"{values[i]:g} then {values[i + 1]:g} at frame {i + 1}", "increasing times")
    median = float(np.median(intervals))
    if not INTERVAL_RANGE_S[0] <= median <= INTERVAL_RANGE_S[1] or intervals.max() > GAP_MAX_S:
        text = f"a median interval of {median:g} s and a longest of {intervals.max():g} s"
        low, high = INTERVAL_RANGE_S
        valid = f"times in seconds, median interval {low:g} to {high:g}, no gap above {GAP_MAX_S:g}"
        arrays.fail("times_s", text, valid)
    return values


def part(arrays: Arrays, frames: int) -> Part | None:
    """Which frames of its source the file holds, of so many; None: all."""
    if PART not in arrays:
        return None
    values = arrays.finite(PART, (3,))
    first, every, count = (int(value) for value in values)
    last = first + every * (frames - 1)
    if (values != [first, every, count]).any() or first < 0 or every < 1 or count < 0 or 0 < count <= last:
        valid = "the number of the first frame, the step to the next, and how many there are (0: not known)"
        arrays.fail(PART, f"{values.tolist()} for {counted(frames, 'frame')}", valid)
    return Part(first, every, count)


def camera(arrays: Arrays, frames: int) -> Camera | None:
    """The lens, and the path over so many frames where the file has one; None without either."""
    size = arrays.finite("image_size_px", (2,)) if "image_size_px" in arrays else None
    low, high = ranges.SIDE_PX
    if size is not None and ((size < low).any() or (size > high).any() or (size != np.round(size)).any()):
        valid = f"width and height, whole numbers from {low} to {high}"
        arrays.fail("image_size_px", str(size.tolist()), valid)
    if not any(key in arrays for key in CAMERA):
        return None
    matrix = arrays.finite("camera_K", (3, 3))
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        text = f"focal lengths {matrix[0, 0]:g} and {matrix[1, 1]:g}"
        arrays.fail("camera_K", text, "focal lengths above 0 px")
    off = matrix[[0, 1, 2, 2], [1, 0, 0, 1]]  # (4,) skew and the other entries that a pinhole has at 0
    if np.abs(off).max() > 1e-6 or abs(matrix[2, 2] - 1) > 1e-6:
        arrays.fail("camera_K", str(matrix.tolist()), "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels")
    if size is None:
        arrays.fail("image_size_px", "a camera without an image size", "width and height in pixels")
    distortion = arrays.finite("camera_dist", (5,)) if "camera_dist" in arrays else np.zeros(5)
    _check_lens(arrays, matrix, distortion, float(size.max()))
    path = _path(arrays, "world_to_camera", frames) if "world_to_camera" in arrays else None
    sigma = arrays.scalar("focal_sigma", FOCAL_SIGMA, "") if "focal_sigma" in arrays else 0.0
    return Camera(Lens(matrix, distortion, (int(size[0]), int(size[1])), sigma), path)


def _check_lens(arrays: Arrays, matrix: Array, distortion: Array, side: float) -> None:
    """Compare a lens with what lenses are like, for images with this longer side."""
    low, high = (factor * side for factor in ranges.FOCAL_SIDES)
    focal = matrix[[0, 1], [0, 1]]
    if (focal < low).any() or (focal > high).any():
        text = f"focal lengths {focal[0]:g} and {focal[1]:g}"
        arrays.fail("camera_K", text, f"{low:g} to {high:g} px for images of {side:g} px")
    if (np.abs(matrix[:2, 2]) > ranges.PIXEL_SIDES * side).any():
        text = f"the centre {matrix[0, 2]:g}, {matrix[1, 2]:g}"
        arrays.fail("camera_K", text, f"within {ranges.PIXEL_SIDES * side:g} px of the image's corner")
    if (np.abs(distortion) > ranges.DISTORTION_MAX).any():
        text = f"a coefficient of {np.abs(distortion).max():g}"
        arrays.fail("camera_dist", text, f"at most {ranges.DISTORTION_MAX:g}")


def _check_places(arrays: Arrays, key: str, places: Array, most: float, unit: str) -> None:
    """Refuse what is further from the origin than anything is."""
    if (np.abs(places) > most).any():
        arrays.fail(key, f"a number of {np.nanmax(np.abs(places)):g}", f"at most {most:g} {unit}")


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
    _check_places(arrays, key, poses[:, :3, 3], ranges.POSITION_MAX_M, "m")
    return poses if moving else np.broadcast_to(poses, (frames, 4, 4))


def _has(arrays: Arrays, keys: tuple[str, ...]) -> bool:
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


def lengths(arrays: Arrays) -> tuple[tuple[str, float], ...]:
    """Lengths that the file states of the person, by name, m."""
    if not _has(arrays, LENGTHS):
        return ()
    names, valid = arrays.names("length_names", "L"), bodies.stated_lengths()
    if unknown := [name for name in names if name not in valid]:
        arrays.fail("length_names", f"unknown {listed(unknown)}", ", ".join(valid))
    values = arrays.finite("lengths_m", ("L",))
    if (values <= 0).any() or (values > EXTENT_MAX_M).any():
        arrays.fail(
            "lengths_m", f"{values.min():g} to {values.max():g}", f"above 0, at most {EXTENT_MAX_M:g} m"
        )
    return tuple(zip(names, values.tolist(), strict=True))


def with_keypoints(arrays: Arrays, evidence: Evidence) -> Evidence:
    """The evidence with 2D landmarks, if the file has them."""
    frames = len(evidence.times_s)
    if not _has(arrays, KEYPOINTS):
        return replace(evidence, keypoints_px=np.empty((frames, 0, 2)), scores=np.empty((frames, 0)))
    names = arrays.names("keypoint_names", "J")
    points = _points(arrays, "keypoints_px", ("T", "J", 2))
    if evidence.camera is not None:
        most = ranges.PIXEL_SIDES * max(evidence.camera.lens.image_size_px)
        _check_places(arrays, "keypoints_px", points, most, "px")
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


def with_joints(arrays: Arrays, evidence: Evidence) -> Evidence:
    """The evidence with a 3D estimate, if the file has one."""
    if not _has(arrays, JOINTS):
        return replace(evidence, joints_m=np.empty((len(evidence.times_s), 0, 3)))
    names = arrays.names("joint_names", "K")
    joints = _points(arrays, "joints_m", ("T", "K", 3))
    known = joints[~np.isnan(joints).any((1, 2))]
    extent = float(np.median(np.ptp(known, axis=1).max(-1))) if len(known) else 0.0
    if extent > EXTENT_MAX_M:
        arrays.fail("joints_m", f"a person {extent:g} across", f"metres, at most {EXTENT_MAX_M:g} m across")
    _check_places(arrays, "joints_m", joints, ranges.POSITION_MAX_M, "m")
    frame = arrays.text("joints_frame", FRAMES)
    return replace(evidence, joint_names=names, joints_m=joints, joints_frame=frame)


def unused(arrays: Arrays) -> list[str]:
    """Keys of what is checked and left out: joint rotations, and shape parameters of somebody else's body."""
    unused = ["betas"] if "betas" in arrays else []
    if unused:
        arrays.finite("betas", ("S",))
    if not _has(arrays, ROTATIONS):
        return unused
    arrays.names("rotation_names", "B")
    rotations = _points(arrays, "rotations", ("T", "B", 4))
    norms = np.linalg.norm(rotations, axis=-1, keepdims=True)  # (T, B, 1)
    if (np.abs(norms - 1) > UNIT_TOLERANCE).any():
        text = f"norms {np.nanmin(norms):g} to {np.nanmax(norms):g}"
        arrays.fail("rotations", text, "unit quaternions w x y z")
    return ["rotations", *unused]
