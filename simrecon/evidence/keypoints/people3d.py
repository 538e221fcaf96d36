"""People with landmarks in the image and joints in space that project onto them, so the lens follows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import tracks
from simrecon.evidence.keypoints.following import Detection, follow
from simrecon.evidence.options import Options
from simrecon.evidence.values import as_array, bounded
from simrecon.types import Array, Camera, Evidence, Lens

AGREE_PX = 2.0


@dataclass(frozen=True, eq=False)
class Person:
    """One person in one frame: joints (J, 3) on the camera's axes, their place (3,), focal length or NaN."""

    joints_m: Array
    place_m: Array
    focal_px: float


def to_evidence(
    content: Content,
    options: Options,
    detections: list[Detection],
    people: list[Person],
    names: tuple[str, ...],
    size: tuple[int, int] | None,
) -> Evidence:
    """Landmarks and joints of the person, and the lens that makes the one of the other."""
    evidence = tracks.to_evidence(content, detections, names, options)
    track, _ = follow(content, detections, options.person)
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
        off = f"landmarks {off_px:.1f} px off the projected 3D joints"
        raise content.fail("pred_keypoints_2d, 2d_joints", off, f"at most {AGREE_PX:g} px, or --fov")
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


def array(content: Content, key: str, value: Any, shape: tuple[int | None, ...] | None) -> Array:
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
    return bounded(content, key, array.astype(float))
