"""Cameras in TOML: simrecon's own file, and those of Pose2Sim (after Anipose) and Caliscope."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.camera import calibration
from simrecon.evidence.camera.calibration import Calibration
from simrecon.evidence.values import as_array
from simrecon.io import toml
from simrecon.io.arrays import Arrays

OWN_KEYS = ("image_size_px", "matrix_px", "focal_px", "centre_px", "distortion", "world_to_camera")


def read(path: Path, raw: bytes) -> list[Calibration]:
    """The cameras of a file with the bytes `raw`.

    Raises:
        InputError: no TOML, or one without a camera.
    """
    try:
        tree = toml.loads(raw.decode("utf-8-sig"), str(path))
    except (ValueError, InputError) as error:
        valid = "TOML of simrecon, Pose2Sim or Caliscope, or YAML, XML or JSON of OpenCV's FileStorage"
        raise InputError(
            f"{path}: found no camera file ({' '.join(str(error).split())}); valid: {valid}"
        ) from error
    tables = tree.get("cameras", tree)
    tables = tables if isinstance(tables, Mapping) else tree
    cameras = {key: one for key, one in tables.items() if isinstance(one, Mapping) and "matrix" in one}
    if cameras:
        return [_section(path, key, one) for key, one in cameras.items() if not one.get("ignore", False)]
    return [_own(path, tree)]


def _section(path: Path, key: str, one: Mapping[str, Any]) -> Calibration:
    """A camera as Pose2Sim (after Anipose) and Caliscope write it."""
    if one.get("fisheye"):
        raise InputError(f"{path}: {key}.fisheye: found true; valid: a camera without fisheye distortion")
    arrays = Arrays(str(path), {f"{key}.{k}": a for k, v in one.items() if (a := as_array(v)) is not None})
    matrix = calibration.matrix(path, f"{key}.matrix", arrays.finite(f"{key}.matrix", (3, 3)))
    distortion = (
        calibration.distortion(path, f"{key}.distortions", arrays.finite(f"{key}.distortions", ("D",)))
        if f"{key}.distortions" in arrays and arrays.array(f"{key}.distortions").size
        else np.zeros(5)
    )
    size = arrays.finite(f"{key}.size", (2,)) if f"{key}.size" in arrays else None
    pose = None
    if f"{key}.rotation" in arrays and f"{key}.translation" in arrays:
        rotation = np.asarray(one["rotation"], float)
        if rotation.size not in (3, 9) or np.size(one["translation"]) != 3:
            arrays.fail(f"{key}.rotation", f"shape {rotation.shape}", "(3,) or (3, 3), with translation (3,)")
        pose = calibration.rigid(path, f"{key}.rotation", rotation, arrays.finite(f"{key}.translation", (3,)))
    name = one.get("name", key)
    size_px = calibration.size(path, f"{key}.size", size)
    return Calibration(str(name), matrix, distortion, size_px, pose)


def _own(path: Path, tree: Mapping[str, Any]) -> Calibration:
    """Simrecon's own camera file."""
    arrays = Arrays(str(path), {k: a for k, v in tree.items() if (a := as_array(v)) is not None})
    if unknown := [key for key in tree if key not in OWN_KEYS]:
        arrays.fail(", ".join(unknown), "an unknown key", ", ".join(OWN_KEYS))
    size = arrays.finite("image_size_px", (2,))
    if "matrix_px" in arrays:
        matrix = arrays.finite("matrix_px", (3, 3))
    else:
        given = arrays.array("focal_px")
        if given.shape not in ((), (1,), (2,)):
            arrays.fail("focal_px", f"shape {given.shape}", "one focal length, or two")
        focal = np.broadcast_to(arrays.finite("focal_px", given.shape), (2,))
        centre = arrays.finite("centre_px", (2,)) if "centre_px" in arrays else (size - 1) / 2
        matrix = np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1.0]])
    key = "matrix_px" if "matrix_px" in arrays else "focal_px"
    distortion = arrays.finite("distortion", ("D",)) if "distortion" in arrays else np.zeros(5)
    pose = None
    if "world_to_camera" in arrays:
        whole = arrays.finite("world_to_camera", (4, 4))
        pose = calibration.rigid(path, "world_to_camera", whole[:3, :3], whole[:3, 3])
    matrix = calibration.matrix(path, key, matrix)
    distortion = calibration.distortion(path, "distortion", distortion)
    return Calibration(
        path.stem, matrix, distortion, calibration.size(path, "image_size_px", size), pose, z_up=True
    )
