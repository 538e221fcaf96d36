"""Videos of a flip that nobody has filmed: the skin of a recorded motion, painted over a photograph.

The motion is fitted to a body of simrecon's shape space, which wears a shirt, trousers and hair, and is seen
by the camera of a real video, where the man of that video stood. The photograph is a frame of that video
without him; who else is in it stays there. The shutter is open for half of the time, so fast limbs blur.
Where the joints really are is known, whatever a network finds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import mujoco
import numpy as np

from simrecon import evidence as readers
from simrecon import kinematics
from simrecon import plan as plans
from simrecon.body import clothed, skeleton
from simrecon.drawing import canvas, figure
from simrecon.drawing.shading import shades
from simrecon.evidence.video.blazepose import NAMES
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations, vectors
from simrecon.scene import build
from simrecon.sim.models import compile_text
from simrecon.types import Array, Camera, IntArray, KinematicFit, Scene

RATE_HZ = 30.0
OPEN_SHARE, MOMENTS = 0.5, 3
"""Of the time the shutter is open, at so many moments of which the person is painted."""
JOINTS = tuple(
    f"{side}_{joint}" for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    for side in ("left", "right")
)  # fmt: skip
COLOURS = {
    "shirt": (60.0, 52.0, 168.0), "trousers": (92.0, 62.0, 48.0), "skin": (126.0, 158.0, 210.0),
    "hair": (34.0, 44.0, 62.0), "shoes": (225.0, 225.0, 230.0),
}  # fmt: skip
"""Blue, green, red."""
HAIR_BACK_M, HAIR_UP_M = 0.0, 0.12
"""Of the head, what is behind this and over its joint, and all that is higher than that."""
SHOE_M = 0.1


@dataclass(frozen=True, eq=False)
class Filmed:
    """A motion before a camera. T frames of the video.

    Attributes:
        fit: the motion; its times are denser than frames.
        camera: that stands still.
        columns: (12,) BlazePose's numbers of `JOINTS`.
        true_px: (T, 12, 2) where they are in the image.
        height_px: (T,) of the person, standing as far away.
    """

    fit: KinematicFit
    camera: Camera
    columns: IntArray
    true_px: Array
    height_px: Array


def filmed(recording: Path, video: Path, *, place_m: tuple[float, float], heading_deg: float) -> Filmed:
    """A recording before the camera of a video.

    Args:
        recording: a motion that `simrecon run` reads.
        video: evidence of the real video, for its camera.
        place_m: where in its world the hips are on average.
        heading_deg: by which the motion is turned about the vertical.
    """
    seen, _ = readers.resample(readers.read(recording))
    fit = _placed(kinematics.fit(seen, Scene(), plans.read("quick").kinematics), place_m, heading_deg)
    camera = cameras.at(_known(readers.read(video).camera), slice(0, 1))
    frames = int((fit.times_s[-1] - fit.times_s[0]) * RATE_HZ)
    middle = fit.times_s[0] + (np.arange(frames) + OPEN_SHARE / 2) / RATE_HZ
    _, marks = kinematics.configurations(fit.body, poses_at(fit, middle))  # (T, M, 3)
    points = marks[:, [fit.body.skeleton.point_names.index(name) for name in JOINTS]]
    pixels = cameras.project(cameras.lasting(camera, frames), points) - 0.5
    far = cameras.to_camera(cameras.lasting(camera, frames), marks.mean(axis=1, keepdims=True))[:, 0, 2]
    height = fit.body.height_m * cameras.focal_px(camera.lens) / far
    return Filmed(fit, camera, np.array([NAMES.index(name) for name in JOINTS]), pixels, height)


def frames(made: Filmed, behind: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    """The frames of the video over those behind."""
    model = compile_text(build(made.fit.body.mjcf, Scene(), 0.01))
    data, skin = mujoco.MjData(model), clothed.skin(made.fit.body)
    worn, colours = figure.Worn.of(model, skin), _clothes(skin)
    for frame, image in zip(range(len(made.true_px)), behind, strict=False):
        moments = made.fit.times_s[0] + (frame + np.linspace(0, OPEN_SHARE, MOMENTS)) / RATE_HZ
        total = np.zeros(image.shape, np.float32)
        for qpos in poses_at(made.fit, moments):
            data.qpos[: len(qpos)] = qpos
            mujoco.mj_kinematics(model, data)
            total += _painted(image, made.camera, worn.place(data), skin.faces, colours)
        yield np.clip(total / MOMENTS, 0, 255).astype(np.uint8)


def poses_at(fit: KinematicFit, times_s: Array) -> Array:
    """Poses (N, nq) of a fit between its frames: the nearest, moved and turned to the moment."""
    model = compile_text(fit.body.mjcf)
    after = np.clip(np.searchsorted(fit.times_s, times_s), 1, len(fit.times_s) - 1)
    rows = []
    for time_s, row in zip(times_s, after, strict=True):
        begin, end = fit.times_s[row - 1], fit.times_s[row]
        way, qpos = np.zeros(model.nv), fit.qpos[row - 1].copy()
        mujoco.mj_differentiatePos(model, way, 1.0, qpos, fit.qpos[row])
        mujoco.mj_integratePos(model, qpos, way, float((time_s - begin) / (end - begin)))
        rows.append(qpos)
    return np.array(rows)


def plate(images: Iterator[np.ndarray], outlines_px: Iterator[Array], *, grow: float) -> np.ndarray:
    """A photograph without the person: each pixel the mean of the frames in which it isn't theirs.

    Args:
        images: frames of a camera that stands still.
        outlines_px: (J, 2) landmarks of the person in each, NaN where hidden.
        grow: by which their outline is widened, in its heights.
    """
    shown, covered = [], []
    for image, points in zip(images, outlines_px, strict=True):
        shown.append(image)
        covered.append(outline(points, image.shape[:2], grow))
    free = np.array(covered) == 0  # (F, H, W)
    stack = np.where(free[..., None], np.array(shown), 0)
    count = np.maximum(free.sum(axis=0), 1)[..., None]
    mean = (stack.sum(axis=0, dtype=np.int64) / count).astype(np.uint8)
    never = (~free.any(axis=0)).astype(np.uint8)
    return np.asarray(cv2.inpaint(mean, never, 7, cv2.INPAINT_TELEA))


def outline(points_px: Array, shape: tuple[int, ...], grow: float) -> np.ndarray:
    """Mask (H, W), 255 within the widened outline of landmarks (J, 2)."""
    known = points_px[np.isfinite(points_px).all(axis=1)]
    mask: np.ndarray = np.zeros(shape[:2], np.uint8)
    cv2.fillConvexPoly(mask, cv2.convexHull(known.astype(np.float32)).astype(np.int32), 255)
    size = int(grow * np.ptp(known[:, 1])) | 1
    return cv2.dilate(mask, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))


def _known(camera: Camera | None) -> Camera:
    if camera is None:
        raise ValueError("found no camera in the evidence of the video")
    return camera


def _placed(fit: KinematicFit, place_m: tuple[float, float], heading_deg: float) -> KinematicFit:
    """A fit turned about the vertical and moved over the floor."""
    turn = rotations.exp(np.array([0.0, 0.0, np.radians(heading_deg)]))
    qpos = fit.qpos.copy()
    qpos[:, :3] = qpos[:, :3] @ rotations.matrix(turn).T
    qpos[:, :2] += np.array(place_m) - qpos[:, :2].mean(axis=0)
    qpos[:, 3:7] = rotations.multiply(turn, qpos[:, 3:7])
    return replace(fit, qpos=qpos)


def _painted(image: np.ndarray, camera: Camera, vertices_m: Array, faces: IntArray, colours: Array) -> Array:
    """The image with a person before it."""
    pixels = cameras.project(camera, vertices_m[None])[0][faces]  # (F, 3, 2)
    corners = vertices_m[faces]
    normals = vectors.unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    towards = vectors.unit(cameras.centre_m(camera) - corners.mean(axis=1))
    facing = (normals * towards).sum(axis=-1)
    keep = np.flatnonzero(facing > 0)
    far = np.linalg.norm(cameras.centre_m(camera) - corners.mean(axis=1), axis=-1)
    keep = keep[np.argsort(-far[keep], kind="stable")]
    shade = shades(camera, normals[keep], facing[keep])[:, None]
    tones = np.minimum(colours[faces[keep]].mean(axis=1) * shade, 255.0)
    result = image.copy()
    canvas.paint(result, pixels[keep], tones, 1.0)
    return result.astype(np.float32)


def _clothes(skin: clothed.Skin) -> Array:
    """Colours (V, 3) of the vertices, by the segment that moves each most."""
    names = skeleton.template().names
    of = np.array([names[row] for row in skin.weights.argmax(axis=1)])
    colours = np.tile(COLOURS["skin"], (len(of), 1))
    colours[np.isin(of, ("spine", "chest", "left_shoulder", "right_shoulder"))] = COLOURS["shirt"]
    colours[np.isin(of, ("pelvis", "left_hip", "right_hip", "left_knee", "right_knee"))] = COLOURS["trousers"]
    colours[np.isin(of, ("left_ankle", "right_ankle"))] = COLOURS["shoes"]
    off = skin.vertices_m - skin.origins_m[names.index("head")]
    hair = (of == "head") & ((off[:, 0] < HAIR_BACK_M) & (off[:, 2] > 0) | (off[:, 2] > HAIR_UP_M))
    colours[hair] = COLOURS["hair"]
    return colours
