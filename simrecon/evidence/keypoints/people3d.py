"""PHALP and 4DHumans, and SAM 3D Body: people by frame with landmarks in the image and joints in space.

PHALP: by frame `tid`, `3d_joints` (the first 25 in OpenPose's order), `2d_joints` as shares of the longer
side of the image, padded to a square, `size`, `tracked_time` (0 where the person was seen). Its camera is
nearly orthographic and its distance no distance: the joints are taken as a shape around the hips.

SAM 3D Body: by person `pred_keypoints_3d` and `pred_keypoints_2d` in the order of MHR's first 70 keypoints,
`pred_cam_t`, `focal_length`; a list of frames, each a list of people.

Both project their 3D joints into the image, so the lens follows from the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simrecon.evidence.content import Content, as_array
from simrecon.evidence.keypoints import layouts, tracks
from simrecon.evidence.keypoints.flat import _number
from simrecon.evidence.keypoints.tracks import Detection
from simrecon.evidence.options import Options
from simrecon.types import Array, Camera, Evidence, Lens

AGREE_PX = 2.0
OPENPOSE = 25


@dataclass(frozen=True, eq=False)
class _Person:
    """One person in one frame: joints (J, 3) on the camera's axes, their place (3,), focal length or NaN."""

    joints_m: Array
    place_m: Array
    focal_px: float


def matches_phalp(content: Content) -> bool:
    """Whether the file is PHALP's."""
    tree = content.tree
    first = next(iter(tree.values()), None) if isinstance(tree, Mapping) else None
    return isinstance(first, Mapping) and "3d_joints" in first and "tid" in first


def matches_sam(content: Content) -> bool:
    """Whether the file is SAM 3D Body's."""
    return any("pred_keypoints_3d" in person for _, person in _sam_people(content.tree, first=True))


def read_phalp(content: Content, options: Options) -> Evidence:
    """Evidence of one person of a PHALP file."""
    found: list[Detection] = []
    people: list[_Person] = []
    sizes: set[tuple[int, int]] = set()
    for i, (name, frame) in enumerate(content.tree.items()):
        number = int(frame.get("time", i)) if isinstance(frame, Mapping) else i
        for k, who in enumerate(_row(content, name, frame, "tid")):
            late = _row(content, name, frame, "tracked_time") if "tracked_time" in frame else []
            if len(late) > k and int(late[k]) > 0:
                continue  # not seen in this frame; the values are those of an earlier one
            key = f"{name}.3d_joints[{k}]"
            joints = _array(content, key, _at(content, name, frame, "3d_joints", k), (None, 3))
            size = _array(content, f"{name}.size[{k}]", _at(content, name, frame, "size", k), (2,))
            height, width = (int(n) for n in size)
            sizes.add((width, height))
            flat = _array(content, f"{name}.2d_joints[{k}]", _at(content, name, frame, "2d_joints", k), None)
            points = flat.reshape(-1, 2)[: len(joints)] * max(width, height)
            points -= [(max(width, height) - width) / 2, (max(width, height) - height) / 2]
            if len(points) < OPENPOSE or len(joints) < OPENPOSE:
                raise content.fail(key, f"{len(joints)} joints", f"{OPENPOSE} or more")
            place = _array(content, f"{name}.camera[{k}]", _at(content, name, frame, "camera", k), (3,))
            found.append(
                tracks.detection(number, points[:OPENPOSE], np.ones(OPENPOSE), str(who), len(people))
            )
            people.append(_Person(joints[:OPENPOSE], place, np.nan))
    if len(sizes) > 1:
        raise content.fail("size", f"{len(sizes)} sizes of images", "one")
    return _evidence(content, options, found, people, layouts.layout("openpose_25"), next(iter(sizes), None))


def read_sam(content: Content, options: Options) -> Evidence:
    """Evidence of one person of SAM 3D Body's outputs."""
    found: list[Detection] = []
    people: list[_Person] = []
    names = layouts.layout("mhr_70")
    for where, person in _sam_people(content.tree, first=False):
        number, label = where
        joints = _array(
            content, f"{label}.pred_keypoints_3d", person.get("pred_keypoints_3d"), (len(names), 3)
        )
        points = _array(
            content, f"{label}.pred_keypoints_2d", person.get("pred_keypoints_2d"), (len(names), 2)
        )
        place = _array(content, f"{label}.pred_cam_t", person.get("pred_cam_t"), (3,))
        focal = _array(content, f"{label}.focal_length", person.get("focal_length"), None).reshape(-1)
        if not (focal > 0).all():
            raise content.fail(f"{label}.focal_length", f"{focal.min():g}", "above 0 px")
        who = person.get("track_id", person.get("person_id"))
        found.append(
            tracks.detection(
                number, points, np.ones(len(names)), None if who is None else str(who), len(people)
            )
        )
        people.append(_Person(joints, place, float(focal.mean())))
    return _evidence(content, options, found, people, names, None)


def _sam_people(tree: Any, *, first: bool) -> list[tuple[tuple[int, str], Mapping[str, Any]]]:
    """People with frame number and a label for messages; only those of the first frame, for a look at it."""
    if isinstance(tree, np.ndarray) and _is_list(tree):
        tree = list(tree)
    if isinstance(tree, Mapping) and "pred_keypoints_3d" in tree:
        return _stacked(tree)
    if isinstance(tree, Mapping):
        frames = [(_number(str(key), i), str(key), value) for i, (key, value) in enumerate(tree.items())]
    elif isinstance(tree, list):
        frames = [(i, f"[{i}]", value) for i, value in enumerate(tree)]
    else:
        return []
    people = []
    for number, label, frame in frames[:8] if first else frames:
        if isinstance(frame, Mapping) and "pred_keypoints_3d" not in frame:
            frame = frame.get("outputs", frame.get("people", frame))
        listed = [frame] if isinstance(frame, Mapping) else list(frame) if _is_list(frame) else []
        people += [
            ((number, f"{label}[{k}]"), person)
            for k, person in enumerate(listed)
            if isinstance(person, Mapping)
        ]
    return people


def _is_list(frame: Any) -> bool:
    if isinstance(frame, np.ndarray):
        return bool(frame.dtype.hasobject and frame.ndim)
    return isinstance(frame, (list, tuple))


def _stacked(tree: Mapping[str, Any]) -> list[tuple[tuple[int, str], Mapping[str, Any]]]:
    """One person with all frames in one array."""
    joints = as_array(tree["pred_keypoints_3d"])
    if joints is None or joints.ndim != 3:
        return [((0, "people[0]"), tree)]
    rows = {key: array for key, value in tree.items() if (array := as_array(value)) is not None}
    per_frame = {key: array for key, array in rows.items() if array.ndim and len(array) == len(joints)}
    shared = {key: array for key, array in rows.items() if key not in per_frame}
    return [
        ((i, f"[{i}]"), shared | {key: array[i] for key, array in per_frame.items()} | {"track_id": 0})
        for i in range(len(joints))
    ]


def _evidence(
    content: Content,
    options: Options,
    found: list[Detection],
    people: list[_Person],
    names: tuple[str, ...],
    size: tuple[int, int] | None,
) -> Evidence:
    """Landmarks and joints of the person, and the lens that makes the one of the other."""
    evidence = tracks.to_evidence(content, found, names, options)
    track, _ = tracks.follow(content, found, options.person)
    mine = [people[one.index] for one in track]
    joints, places = np.stack([one.joints_m for one in mine]), np.stack([one.place_m for one in mine])
    pixels = np.stack([one.points_px for one in track])  # (T, J, 2)
    keep = [i for i, name in enumerate(names) if name]
    focals = np.array([one.focal_px for one in mine])
    weak = bool(np.isnan(focals).all())
    camera, off_px = options.camera, 0.0
    if not weak:  # one lens for all frames: the distance changes with the focal length
        focal = float(np.median(focals))
        places = places * np.stack((np.ones(len(focals)), np.ones(len(focals)), focal / focals), axis=-1)
    if camera is None:
        camera, off_px = lens(joints + places[:, None], pixels, size)
    if off_px > AGREE_PX:
        found_text = f"landmarks {off_px:.1f} px off the projected 3D joints"
        raise content.fail("pred_keypoints_2d, 2d_joints", found_text, f"at most {AGREE_PX:g} px, or --fov")
    note = f"focal length {camera.lens.matrix_px[0, 0]:.0f} px"
    if weak:
        note += " (nearly orthographic: give --fov for the real one), distance not used"
    hips = joints[:, [i for i, name in enumerate(names) if name in ("LHip", "RHip", "left_hip", "right_hip")]]
    return replace(
        evidence,
        joint_names=tuple(names[i] for i in keep),
        joints_m=(joints - hips.mean(axis=1, keepdims=True) if weak else joints + places[:, None])[:, keep],
        joints_frame="camera_root_relative" if weak else "camera",
        camera=camera,
        reading=f"{evidence.reading}; frame camera; {note}",
    )


def lens(joints_m: Array, pixels: Array, size: tuple[int, int] | None) -> tuple[Camera, float]:
    """The pinhole that projects joints onto landmarks: u = f x/z + c_x, v = f y/z + c_y, by least squares.

    Args:
        joints_m: (T, J, 3) in the camera's frame.
        pixels: (T, J, 2).
        size: of the image; None = twice the principal point.

    Returns:
        The camera, and the median distance of the projections from the landmarks, px.
    """
    rays = (joints_m[..., :2] / joints_m[..., 2:]).reshape(-1, 2)
    seen = pixels.reshape(-1, 2)
    known = np.isfinite(rays).all(axis=-1) & np.isfinite(seen).all(axis=-1)
    rays, seen = rays[known], seen[known]
    centred_rays, centred = rays - rays.mean(axis=0), seen - seen.mean(axis=0)
    focal = float(np.sum(centred_rays * centred) / max(float(np.sum(centred_rays**2)), 1e-18))
    centre = seen.mean(axis=0) - focal * rays.mean(axis=0)
    off = np.linalg.norm(focal * rays + centre - seen, axis=-1)
    matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
    wide, high = size or (round(2 * float(centre[0])), round(2 * float(centre[1])))
    return Camera(Lens(matrix, np.zeros(5), (wide, high))), float(np.median(off))


def _row(content: Content, name: Any, frame: Any, key: str) -> list[Any]:
    found = frame.get(key) if isinstance(frame, Mapping) else None
    if not isinstance(found, (list, tuple, np.ndarray)):
        raise content.fail(f"{name}.{key}", "no such list", "a list of people")
    return list(found)


def _at(content: Content, name: Any, frame: Any, key: str, index: int) -> Any:
    row = _row(content, name, frame, key)
    if index >= len(row):
        raise content.fail(f"{name}.{key}", f"{len(row)} people", f"{index + 1} or more, as in tid")
    return row[index]


def _array(content: Content, key: str, value: Any, shape: tuple[int | None, ...] | None) -> Array:
    """Finite numbers of a shape; None in it = any size."""
    array = as_array(value)
    if array is None or array.dtype.kind not in "fiu":
        raise content.fail(key, "no numbers" if value is not None else "no such key", "an array of numbers")
    array = np.squeeze(array) if shape is not None and array.ndim > len(shape) else array
    fits = shape is None or (
        array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape, strict=True))
    )
    if not fits:
        raise content.fail(key, f"shape {array.shape}", f"shape {str(shape).replace('None', 'J')}")
    if not np.isfinite(array).all():
        raise content.fail(key, "NaN or infinite values", "finite numbers")
    return array.astype(float)
