"""The camera that saw a clip, and the frames of its video."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from simrecon import kinematics
from simrecon.body import names
from simrecon.drawing import video
from simrecon.drawing.video import Image
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from simrecon.job import Job, inputs
from simrecon.studio.clip import Clip
from simrecon.types import Array, Camera, Evidence, KinematicFit, Part

SIDE_PX = 480
"""Longer side of a video's frames as they are shown."""
_LEAST_POINTS, _SURE = 30, 0.5


@dataclass(frozen=True, eq=False)
class Seen:
    """What the camera saw.

    Attributes:
        camera: with a path of the clip's frames (T, 4, 4).
        video: path of the video, None: there is none.
        part: which frames of the video the clip's are; turn_deg: by which they are turned.
        found: whether the path was found again from the poses, for nothing says where the camera stood.
    """

    camera: Camera
    video: str | None = None
    part: Part | None = None
    turn_deg: int = 0
    found: bool = False

    def pose(self, frame: int) -> tuple[Array, Array]:
        """Place (3,) and orientation (4,) of the camera in the world: x right, y down, z forward."""
        centre = cameras.centre_m(cameras.at(self.camera, slice(frame, frame + 1)))[0]
        turn = cameras.extrinsics(self.camera)[frame, :3, :3].T
        return centre, rotations.from_matrix(turn[None])[0]

    @property
    def fov_rad(self) -> float:
        """Vertical field of view."""
        height = self.camera.lens.image_size_px[1]
        return float(2 * np.arctan(height / 2 / self.camera.lens.matrix_px[1, 1]))


def of(job: Job, clip: Clip, evidence: Evidence, fit: KinematicFit | None = None) -> Seen | None:
    """The camera of a clip; None where nothing says where it stood."""
    camera, times, found = evidence.camera, evidence.times_s, False
    if camera is not None and camera.path is None:
        if fit is not None:
            camera, times = fit.camera, fit.times_s
        else:
            camera, found = _resected(clip, evidence), True
    if camera is None or camera.path is None:
        return None
    same = np.array_equal(times, clip.times_s)
    camera = camera if same else cameras.resampled(camera, times, clip.times_s)
    shown = inputs.background(job)
    there = shown if shown is not None and Path(shown).is_file() else None
    part = evidence.part if np.array_equal(evidence.times_s, clip.times_s) else None
    return Seen(camera, there, part, job.reading.rotate or 0, found)


def images(seen: Seen, times_s: Array) -> list[Image]:
    """The video's frames at times (T,), red green blue, small.

    Raises:
        InputError: the video can't be read to its end.
    """
    if seen.video is None:
        return []
    return [_small(image) for image in video.frames(seen.video, times_s, seen.part, seen.turn_deg)]


def _small(image: Image) -> Image:
    scale = min(1.0, SIDE_PX / max(image.shape[:2]))
    size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(small[..., ::-1]).astype(np.uint8, copy=False)


def _resected(clip: Clip, evidence: Evidence) -> Camera | None:
    """A camera that stands still, from which the points of the motion are where the landmarks were seen."""
    camera = evidence.camera
    if camera is None or len(evidence.times_s) != clip.frames:
        return None
    points = names.resolve(evidence.keypoint_names)
    known = points != names.IGNORED
    fitted = kinematics.configurations(clip.body, clip.asked_qpos)[
        1
    ]  # nearer to the landmarks than simulated
    world = fitted[:, points[known]].reshape(-1, 3)
    pixels = evidence.keypoints_px[:, known].reshape(-1, 2)
    sure = np.isfinite(pixels).all(axis=1) & (evidence.scores[:, known].ravel() > _SURE)
    if sure.sum() < _LEAST_POINTS:
        return None
    pose = cameras.resected(camera.lens, world[sure], pixels[sure])
    return None if pose is None else cameras.still(camera.lens, pose, clip.frames)
