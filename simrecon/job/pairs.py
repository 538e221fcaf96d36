"""Options that exclude each other, or that have a meaning only beside another."""

from __future__ import annotations

from simrecon.errors import InputError
from simrecon.job.options import Reading


def refuse(reading: Reading) -> None:
    """Refuse options that exclude each other.

    Raises:
        InputError: they stand side by side.
    """
    if reading.keypoints_person is not None and reading.keypoints is None:
        raise InputError("--keypoints-person: found no --keypoints; valid: --keypoints FILE beside it")
    start, end = reading.from_s, reading.to_s
    if start is not None and end is not None and start >= end:
        raise InputError(f"--to: found {end:g} beside --from {start:g}; valid: a later time")
    lens = (reading.camera, reading.fov_deg)
    if reading.size_px is not None and lens == (None, None) and not reading.unknown_camera:
        raise InputError("--size: found no lens for it; valid: --fov, --camera or --unknown-camera beside it")
    if reading.camera_name is not None and reading.camera is None:
        raise InputError("--camera-name: found no camera file; valid: --camera FILE beside it")
    if reading.camera is not None and reading.fov_deg is not None:
        raise InputError("--camera: found --fov beside it; valid: one of them")
    lenses = {"--camera": reading.camera, "--fov": reading.fov_deg}
    if reading.unknown_camera and (beside := [name for name, value in lenses.items() if value is not None]):
        raise InputError(f"--unknown-camera: found {beside[0]} beside it; valid: one of them")
