"""The camera from a file: simrecon's TOML, OpenCV's FileStorage, or Pose2Sim's or Caliscope's.

Each becomes K, distortion k1 k2 p1 p2 k3, image size, and, where it is there, the pose. Poses are world
to camera: x_camera = R x_world + t, R as a rotation vector or a matrix.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from simrecon.errors import InputError
from simrecon.evidence.content import as_array
from simrecon.evidence.options import AXES, to_z_up
from simrecon.geometry import camera as cameras
from simrecon.io.arrays import Arrays
from simrecon.types import Array, Camera, Lens

OWN_KEYS = ("image_size_px", "matrix_px", "focal_px", "centre_px", "distortion", "world_to_camera")
_OPENCV = {
    "matrix": ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "intrinsics", "M1"),
    "distortion": (
        "distortion_coefficients",
        "Distortion_Coefficients",
        "dist_coeffs",
        "distCoeffs",
        "D",
        "D1",
    ),
    "width": ("image_width", "image_Width"),
    "height": ("image_height", "image_Height"),
    "size": ("image_size", "imageSize"),
    "rotation": ("rvec", "R"),
    "translation": ("tvec", "T"),
}
ASPECT_ERROR_MAX = 0.005
UPRIGHT_COSINE = 0.3


@dataclass(frozen=True)
class _Found:
    """One camera of a file; `None` = not said."""

    name: str
    matrix: Array
    distortion: Array
    size: tuple[int, int] | None
    pose: Array | None
    own: bool = False


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
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: can't be read ({error.strerror}); give an existing camera file") from error
    listed = _opencv(path, raw) if _is_storage(raw) else _toml(path, raw)
    chosen, how = _choose(path, listed, name, hint)
    lens, scaled = _to_size(path, chosen, size_px)
    pose, stands = _pose(path, chosen, up)
    text = f"{path.name}{how}, focal length {cameras.focal_px(lens):.0f} px{scaled}, {stands}"
    return (Camera(lens) if pose is None else cameras.still(lens, pose)), text


def _is_storage(raw: bytes) -> bool:
    head = raw.lstrip()[:400]
    return (
        head.startswith((b"%YAML", b"<?xml", b"<opencv_storage"))
        or b"!!opencv-matrix" in raw
        or (b"camera_matrix:" in raw)
    )


def _choose(path: Path, cameras: list[_Found], name: str | None, hint: str) -> tuple[_Found, str]:
    names = ", ".join(one.name for one in cameras)
    if name is not None:
        for one in cameras:
            if one.name == name:
                return one, f", camera {name}"
        raise InputError(f"{path}: --camera-name: found {name!r}; valid: {names}")
    if len(cameras) == 1:
        return cameras[0], ""
    plain = _plain(Path(hint).stem)
    fitting = [one for one in cameras if _plain(one.name) and _plain(one.name) in plain]
    if len(fitting) == 1:
        return fitting[0], f", camera {fitting[0].name} (by the video's name)"
    raise InputError(f"{path}: found {len(cameras)} cameras; valid: --camera-name with one of {names}")


def _plain(text: str) -> str:
    return "".join(letter for letter in text.lower() if letter.isalnum())


def _to_size(path: Path, one: _Found, size: tuple[int, int] | None) -> tuple[Lens, str]:
    there = one.size or size
    if there is None:
        raise InputError(f"{path}: image size: found none; valid: one in the file, --size WxH, or a video")
    if size is None or size == there:
        return Lens(one.matrix, one.distortion, there), ""
    factor = size[0] / there[0]
    if abs(size[1] / there[1] / factor - 1) > ASPECT_ERROR_MAX:
        found = f"a camera of {there[0]} x {there[1]} px for images of {size[0]} x {size[1]}"
        turned = " (a turned camera?)" if abs(size[0] / there[1] - size[1] / there[0]) < 0.01 else ""
        raise InputError(f"{path}: image size: found {found}{turned}; valid: the same aspect ratio")
    matrix = one.matrix.copy()
    # The centre of the first pixel is at 0, so its corner is at -0.5.
    matrix[:2] = factor * matrix[:2] + np.array([[0, 0, (factor - 1) / 2]] * 2)
    return Lens(matrix, one.distortion, size), f", scaled by {factor:.3g} from {there[0]} x {there[1]}"


def _pose(path: Path, one: _Found, up: str | None) -> tuple[Array | None, str]:
    if one.pose is None:
        return None, "no pose: the floor is estimated"
    if one.own:
        return one.pose, "with its pose, world z up"
    upward = -one.pose[1, :3]  # (3,) the image's upward direction in the file's world
    if up is None:
        best = max(AXES, key=lambda axis: float(upward @ _axis(axis)))
        if best != "z" or upward[2] < UPRIGHT_COSINE:
            found = f"a camera whose image is upright along {best}"
            raise InputError(f"{path}: up axis: found {found}; valid: --up {', '.join(AXES)}")
    turn = np.eye(4)
    turn[:3, :3] = to_z_up(up or "z")  # ours from theirs
    return one.pose @ turn.T, f"with its pose, world {up or 'z'} up"


def _axis(name: str) -> Array:
    axis = np.zeros(3)
    axis["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return axis


def _rigid(path: Path, key: str, rotation: Array, translation: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(rotation.reshape(3, 1))[0] if rotation.size == 3 else rotation.reshape(3, 3)
    pose[:3, 3] = translation.reshape(3)
    error = np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max()
    if error > 1e-4 or np.linalg.det(pose[:3, :3]) < 0:
        raise InputError(
            f"{path}: {key}: found a matrix that is no rotation; valid: a rotation (3,) or (3, 3)"
        )
    return pose


def _matrix(path: Path, key: str, values: Array) -> Array:
    if values.shape != (3, 3) or values[0, 0] <= 0 or values[1, 1] <= 0 or abs(values[2, 2] - 1) > 1e-6:
        found = values.tolist() if values.size < 10 else f"shape {values.shape}"
        raise InputError(
            f"{path}: {key}: found {found}; valid: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels"
        )
    values = values.copy()
    values[0, 1] = 0.0 if abs(values[0, 1]) < 1e-6 * values[0, 0] else values[0, 1]
    if values[0, 1] != 0:
        raise InputError(f"{path}: {key}: found a skew of {values[0, 1]:g}; valid: 0")
    return values


def _distortion(path: Path, key: str, values: Array) -> Array:
    flat = values.ravel()
    if flat.size > 5 and np.any(flat[5:]):
        found = f"{flat.size} coefficients"
        raise InputError(f"{path}: {key}: found {found}; valid: k1 k2 p1 p2 k3, further ones 0")
    if flat.size < 4 and flat.size != 0:
        raise InputError(f"{path}: {key}: found {flat.size} coefficients; valid: 4 or 5, k1 k2 p1 p2 k3")
    return np.concatenate((flat[:5], np.zeros(max(5 - flat.size, 0))))


def _toml(path: Path, raw: bytes) -> list[_Found]:
    try:
        tree = tomllib.loads(raw.decode("utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
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


def _section(path: Path, key: str, one: Mapping[str, Any]) -> _Found:
    """A camera as Pose2Sim (after Anipose) and Caliscope write it."""
    if one.get("fisheye"):
        raise InputError(f"{path}: {key}.fisheye: found true; valid: a camera without fisheye distortion")
    given = Arrays(str(path), {f"{key}.{k}": a for k, v in one.items() if (a := as_array(v)) is not None})
    matrix = _matrix(path, f"{key}.matrix", given.finite(f"{key}.matrix", (3, 3)))
    distortion = (
        _distortion(path, f"{key}.distortions", given.finite(f"{key}.distortions", ("D",)))
        if f"{key}.distortions" in given and given.array(f"{key}.distortions").size
        else np.zeros(5)
    )
    size = given.finite(f"{key}.size", (2,)) if f"{key}.size" in given else None
    pose = None
    if f"{key}.rotation" in given and f"{key}.translation" in given:
        rotation = np.asarray(one["rotation"], float)
        if rotation.size not in (3, 9) or np.size(one["translation"]) != 3:
            given.fail(f"{key}.rotation", f"shape {rotation.shape}", "(3,) or (3, 3), with translation (3,)")
        pose = _rigid(path, f"{key}.rotation", rotation, given.finite(f"{key}.translation", (3,)))
    name = one.get("name", key)
    return _Found(str(name), matrix, distortion, None if size is None else (int(size[0]), int(size[1])), pose)


def _own(path: Path, tree: Mapping[str, Any]) -> _Found:
    """Simrecon's own camera file."""
    given = Arrays(str(path), {k: a for k, v in tree.items() if (a := as_array(v)) is not None})
    if unknown := [key for key in tree if key not in OWN_KEYS]:
        given.fail(", ".join(unknown), "an unknown key", ", ".join(OWN_KEYS))
    size = given.finite("image_size_px", (2,))
    if "matrix_px" in given:
        matrix = given.finite("matrix_px", (3, 3))
    else:
        focal = np.broadcast_to(given.finite("focal_px", given.array("focal_px").shape), (2,))
        centre = given.finite("centre_px", (2,)) if "centre_px" in given else (size - 1) / 2
        matrix = np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1.0]])
    key = "matrix_px" if "matrix_px" in given else "focal_px"
    distortion = given.finite("distortion", ("D",)) if "distortion" in given else np.zeros(5)
    pose = None
    if "world_to_camera" in given:
        whole = given.finite("world_to_camera", (4, 4))
        pose = _rigid(path, "world_to_camera", whole[:3, :3], whole[:3, 3])
    return _Found(
        path.stem, _matrix(path, key, matrix), _distortion(path, "distortion", distortion),
        (int(size[0]), int(size[1])), pose, own=True,
    )  # fmt: skip


def _opencv(path: Path, raw: bytes) -> list[_Found]:
    text = raw.decode("utf-8", "replace")
    if not text.lstrip().startswith(("%YAML", "<", "{")):
        text = f"%YAML:1.0\n---\n{text}"
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        root = storage.root()
        keys = {k: found for k, names in _OPENCV.items() if (found := _node(root, names)) is not None}
        storage.release()
    except (cv2.error, SystemError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: found a damaged OpenCV file ({reason}); valid: a whole one") from error
    if "matrix" not in keys:
        raise InputError(f"{path}: camera matrix: found none; valid: a key of {', '.join(_OPENCV['matrix'])}")
    matrix = keys["matrix"].reshape(3, 3) if keys["matrix"].size == 9 else keys["matrix"]
    distortion = _distortion(path, "distortion_coefficients", keys.get("distortion", np.zeros(5)))
    size = keys.get("size")
    if "width" in keys and "height" in keys:
        size = np.concatenate((keys["width"].ravel(), keys["height"].ravel()))
    pose = None
    if "rotation" in keys and "translation" in keys:
        pose = _rigid(path, "rvec", keys["rotation"], keys["translation"])
    shape = None if size is None or size.size != 2 else (int(size[0]), int(size[1]))
    return [_Found(path.stem, _matrix(path, "camera_matrix", matrix), distortion, shape, pose)]


def _node(root: Any, names: tuple[str, ...]) -> Array | None:
    for name in names:
        node = root.getNode(name)
        if node.empty() or node.isNone():
            continue
        if node.isMap():
            if not node.getNode("dt").empty():
                return np.asarray(node.mat(), float)
            node = node.getNode("data")  # as ROS writes it: rows, cols, data
        if node.isSeq():
            return np.array([node.at(i).real() for i in range(node.size())])
        return np.array([node.real()])
    return None
