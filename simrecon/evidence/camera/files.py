"""The camera from a file: simrecon's TOML, OpenCV's FileStorage, or Pose2Sim's or Caliscope's.

Each becomes K, distortion k1 k2 p1 p2 k3, image size, and, where it is there, the pose. Poses are world
to camera: x_camera = R x_world + t, R as a rotation vector or a matrix.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simrecon.errors import InputError
from simrecon.evidence import ranges
from simrecon.evidence.axes import AXES, to_z_up, vector
from simrecon.evidence.camera import storage, tables
from simrecon.evidence.camera.calibration import Calibration
from simrecon.geometry import camera as cameras
from simrecon.io.limits import MISFITS
from simrecon.io.reading import TEXT_MAX_BYTES, read_bytes
from simrecon.types import Array, Camera, Lens

ASPECT_ERROR_MAX = 0.005
UPRIGHT_COSINE = 0.3


def read(
    path: str | Path,
    *,
    name: str | None = None,
    size_px: tuple[int, int] | None = None,
    up: str | None = None,
    hint: str = "",
) -> tuple[Camera, str]:
    """The camera of a file.

    Args:
        path: of the file.
        name: of the camera, for files with several.
        size_px: width and height of the images that it is for; K is scaled to it.
        up: axis of the file's world that points up; z if None, and then it must be that.
        hint: a file name that may hold the camera's name, for files with several and no `name`.

    Returns:
        The camera, world z up, in its one place if the file has it, and how the file was understood.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    path = Path(path)
    try:
        raw = read_bytes(path, TEXT_MAX_BYTES)
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); give an existing camera file"
        ) from error
    try:
        listed = storage.read(path, raw) if storage.matches(raw) else tables.read(path, raw)
    except MISFITS as error:
        reason = f"{type(error).__name__}: {error}"[:200]
        raise InputError(f"{path}: found values that do not fit ({reason}); valid: a camera file") from error
    chosen, how = _choose(path, listed, name, hint)
    lens, scaled = _to_size(path, chosen, size_px)
    _check_lens(path, lens)
    pose, stands = _pose(path, chosen, up)
    text = f"{path.name}{how}, focal length {cameras.focal_px(lens):.0f} px{scaled}, {stands}"
    return (Camera(lens) if pose is None else cameras.still(lens, pose)), text


def _check_lens(path: Path, lens: Lens) -> None:
    """Compare the focal lengths with the image: K may be of another size, or in another unit."""
    side = max(lens.image_size_px)
    low, high = (factor * side for factor in ranges.FOCAL_SIDES)
    focal = lens.matrix_px[[0, 1], [0, 1]]
    if (focal < low).any() or (focal > high).any():
        found = f"focal lengths of {focal[0]:g} and {focal[1]:g} px for images of {side} px"
        raise InputError(f"{path}: camera matrix: found {found}; valid: {low:g} to {high:g} px")


def _choose(path: Path, listed: list[Calibration], name: str | None, hint: str) -> tuple[Calibration, str]:
    names = ", ".join(one.name for one in listed)
    if name is not None:
        for one in listed:
            if one.name == name:
                return one, f", camera {name}"
        raise InputError(f"{path}: --camera-name: found {name!r}; valid: {names}")
    if len(listed) == 1:
        return listed[0], ""
    plain = _plain(Path(hint).stem)
    fitting = [one for one in listed if _plain(one.name) and _plain(one.name) in plain]
    if len(fitting) == 1:
        return fitting[0], f", camera {fitting[0].name} (by the video's name)"
    raise InputError(f"{path}: found {len(listed)} cameras; valid: --camera-name with one of {names}")


def _plain(text: str) -> str:
    return "".join(letter for letter in text.lower() if letter.isalnum())


def _to_size(path: Path, one: Calibration, size: tuple[int, int] | None) -> tuple[Lens, str]:
    there = one.size_px or size
    if there is None:
        raise InputError(f"{path}: image size: found none; valid: one in the file, --size WxH, or a video")
    if size is None or size == there:
        return Lens(one.matrix_px, one.distortion, there), ""
    factor = size[0] / there[0]
    if abs(size[1] / there[1] / factor - 1) > ASPECT_ERROR_MAX:
        other = f"a camera of {there[0]} x {there[1]} px for images of {size[0]} x {size[1]}"
        turned = " (a turned camera?)" if abs(size[0] / there[1] - size[1] / there[0]) < 0.01 else ""
        raise InputError(f"{path}: image size: found {other}{turned}; valid: the same aspect ratio")
    matrix = one.matrix_px.copy()
    # The centre of the first pixel is at 0, so its corner is at -0.5.
    matrix[:2] = factor * matrix[:2] + np.array([[0, 0, (factor - 1) / 2]] * 2)
    return Lens(matrix, one.distortion, size), f", scaled by {factor:.3g} from {there[0]} x {there[1]}"


def _pose(path: Path, one: Calibration, up: str | None) -> tuple[Array | None, str]:
    if one.world_to_camera is None:
        return None, "no pose: the floor is estimated"
    if one.z_up:
        return one.world_to_camera, "with its pose, world z up"
    upward = -one.world_to_camera[1, :3]  # (3,) the image's upward direction in the file's world
    if up is None:
        best = max(AXES, key=lambda axis: float(upward @ vector(axis)))
        if best != "z" or upward[2] < UPRIGHT_COSINE:
            upright = f"a camera whose image is upright along {best}"
            raise InputError(f"{path}: up axis: found {upright}; valid: --up {', '.join(AXES)}")
    turn = np.eye(4)
    turn[:3, :3] = to_z_up(up or "z")  # ours from theirs
    return one.world_to_camera @ turn.T, f"with its pose, world {up or 'z'} up"
