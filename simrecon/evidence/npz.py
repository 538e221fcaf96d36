"""Reader and writer of `simrecon.evidence/1`, one `.npz`; the table of its keys is in docs/formats.md."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon import trust
from simrecon.evidence import keys
from simrecon.geometry import camera as cameras
from simrecon.io import atomic
from simrecon.io.arrays import Arrays, listed
from simrecon.io.npz import load
from simrecon.types import Array, Camera, Evidence

SCHEMA = "simrecon.evidence/1"


def read(path: str | os.PathLike[str]) -> Evidence:
    """Read and check `simrecon.evidence/1`.

    Landmarks that were not seen get NaN pixels and score 0; without `camera_dist` there is no distortion.

    Args:
        path: the `.npz`.

    Returns:
        The evidence; its names are not compared with the known ones, which is what `check_names` does.

    Raises:
        InputError: one line with file, key, what is there and what is valid.
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
    content = dumps(evidence, os.fspath(path))
    with atomic.reported(os.fspath(path)):
        atomic.write_bytes(os.fspath(path), content)


def dumps(evidence: Evidence, where: str = "evidence") -> bytes:
    """The bytes of the file that `write` makes; `where` is named in errors.

    Raises:
        InputError: evidence that `read` would refuse.
    """
    content = _content(evidence)
    check(evidence, where)
    return atomic.npz_bytes(content)


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
    if unknown := [key for key in arrays.content if key not in keys.ALL]:
        arrays.fail(listed(unknown), "an unknown key", ", ".join(keys.ALL))
    times = keys.times(arrays)
    evidence = Evidence(
        times_s=times, keypoint_names=(), keypoints_px=np.empty(0), scores=np.empty(0),
        joint_names=(), joints_m=np.empty(0), joints_frame=keys.FRAMES[0],
        mass_kg=arrays.scalar("mass_kg", keys.MASS_RANGE_KG, "kg") if "mass_kg" in arrays else None,
        height_m=arrays.scalar("height_m", keys.HEIGHT_RANGE_M, "m") if "height_m" in arrays else None,
        camera=keys.camera(arrays, len(times)),
        ground_known="ground" not in arrays or arrays.text("ground", keys.GROUNDS) == "known",
        part=keys.part(arrays, len(times)),
        trust=_trust(arrays),
        sha256=arrays.sha256,
    )  # fmt: skip
    evidence = keys.with_joints(arrays, keys.with_keypoints(arrays, evidence))
    evidence = replace(evidence, lengths_m=keys.lengths(arrays))
    if unused := keys.unused(arrays):
        evidence = replace(evidence, reading=f"{listed(unused)} in the file, not used")
    if not evidence.keypoint_names and not evidence.joint_names:
        flat, solid = ", ".join(keys.KEYPOINTS), ", ".join(keys.JOINTS)
        groups = f"{flat} (2D landmarks) or {solid} (3D joints), or both"
        arrays.fail("keypoints_px, joints_m", "neither", groups)
    if evidence.keypoint_names and evidence.camera is None:
        arrays.fail("camera_K", "2D landmarks without a camera", "camera_K (3, 3) beside keypoints_px")
    return evidence


def _path(camera: Camera) -> Array | None:
    """The camera's path as a file has it: one transform where it stands still."""
    path = camera.path
    if path is None or np.ndim(path) != 3 or not len(path):
        return path  # to be refused, unless it is None
    return path[0] if cameras.is_still(camera) else path


def _trust(arrays: Arrays) -> str:
    """What the source is worth, checked; `""` where the file does not say."""
    if "trust" not in arrays:
        return ""
    words = str(arrays.array("trust"))
    trust.parse(words, f"{arrays.source}: trust")
    return words


def _content(evidence: Evidence) -> dict[str, NDArray[Any]]:
    """The arrays of a file by key, without the parts that are empty or None."""
    content: dict[str, Any] = {"schema": SCHEMA, "times_s": evidence.times_s}
    if evidence.keypoint_names:
        values = (evidence.keypoint_names, evidence.keypoints_px, evidence.scores)
        content |= dict(zip(keys.KEYPOINTS, values, strict=True))
    if evidence.joint_names:
        values3d = (evidence.joint_names, evidence.joints_m, evidence.joints_frame)
        content |= dict(zip(keys.JOINTS, values3d, strict=True))
    if (camera := evidence.camera) is not None:
        lens = camera.lens
        content |= {"image_size_px": lens.image_size_px, "camera_K": lens.matrix_px}
        content |= {"camera_dist": lens.distortion, "focal_sigma": lens.focal_sigma or None}
        content |= {"world_to_camera": _path(camera)}
    if not evidence.ground_known:
        content["ground"] = "unknown"
    if (part := evidence.part) is not None:
        content[keys.PART] = np.array([part.first, part.every, part.count])
    if evidence.trust:
        content["trust"] = evidence.trust
    if evidence.lengths_m:
        names, values = zip(*evidence.lengths_m, strict=True)
        content |= {"length_names": names, "lengths_m": values}
    content |= {"mass_kg": evidence.mass_kg, "height_m": evidence.height_m}
    return {key: np.asarray(value) for key, value in content.items() if value is not None}
