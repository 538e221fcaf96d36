"""The options that say how an input is to be read."""

from __future__ import annotations

import argparse
import math
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from simrecon import evidence
from simrecon.cli import arguments
from simrecon.errors import InputError
from simrecon.evidence import formats
from simrecon.evidence.lens import read as read_camera
from simrecon.evidence.options import AXES, FRAMES, UNITS_M
from simrecon.evidence.video import weights
from simrecon.progress import Progress
from simrecon.types import Camera, Evidence

RATE_RANGE_HZ = (2.0, 2000.0)
FOV_RANGE_DEG = (1.0, 170.0)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the options to a command that reads an input."""
    group = parser.add_argument_group("how the input is read, where it doesn't say so itself")
    add_one = group.add_argument
    add_one(
        "--format", choices=formats.names(), metavar="NAME", help=f"{', '.join(formats.names())} [by content]"
    )
    add_one("--up", choices=AXES, metavar="AXIS", help=f"axis of the file that points up: {', '.join(AXES)}")
    add_one("--unit", choices=UNITS_M, help="of lengths in the file")
    add_one("--frame", choices=FRAMES, help="which motion of a file that holds both [world]")
    add_one("--person", metavar="NAME", help="of a file with several people, as it names them")
    add_one("--fps", type=arguments.number(RATE_RANGE_HZ), metavar="HZ", help="frame rate [that of --video]")
    add_one("--keypoints", metavar="FILE", help="2D landmarks that go with the 3D estimate of INPUT")
    add_one("--keypoints-person", metavar="NAME", help="the person in that file")
    add_one(
        "--fov",
        type=arguments.number(FOV_RANGE_DEG),
        metavar="DEG",
        help="horizontal field of view of the camera",
    )
    add_one("--size", type=_size, metavar="WxH", help="of the image in pixels [that of --video]")
    add_one("--camera", metavar="FILE", help="the camera: TOML; OpenCV's YAML; Pose2Sim's, Caliscope's")
    add_one(
        "--unknown-camera",
        action="store_true",
        help="hide the camera: focal length by the image's diagonal, place by the floor",
    )
    add_one("--camera-name", metavar="NAME", help="which camera of that file")
    group = parser.add_argument_group("a video as INPUT (needs the extra video, and simrecon models fetch)")
    group.add_argument(
        "--person-at", type=_place, metavar="X,Y", help="pixel of the first frame where the person is"
    )
    group.add_argument("--model", choices=weights.MODELS, help="pose network [the first that is there]")


def read(options: argparse.Namespace) -> Evidence:
    """Read the input, and say on stderr how it was understood."""
    rate, size = _video(options.video) if options.video is not None else (None, None)
    camera, lens = _lens(options, options.size or size)
    label = Path(options.input).name
    asked = evidence.Options(
        format=options.format,
        up=options.up,
        unit=options.unit,
        frame=options.frame,
        person=options.person,
        fps=options.fps,
        video_fps=rate,
        camera=camera,
        lens=lens,
        person_at=options.person_at,
        model=options.model,
    )
    with _Frames(label) as frames:
        found = evidence.read(
            options.input,
            replace(asked, progress=frames),
            keypoints=options.keypoints,
            keypoints_person=options.keypoints_person,
        )
    if options.unknown_camera:
        found = _without_camera(options, found)
    for line in found.reading.splitlines():
        print(f"read as {line}", file=sys.stderr)
    return found


def _without_camera(options: argparse.Namespace, found: Evidence) -> Evidence:
    given = {"--camera": options.camera, "--fov": options.fov}
    if beside := [name for name, value in given.items() if value is not None]:
        raise InputError(f"--unknown-camera: found {beside[0]} beside it; valid: one of them")
    hidden = evidence.unknown_camera(found)
    if hidden.camera is None:
        return hidden
    said = f"camera: hidden, focal length {hidden.camera.matrix_px[0, 0]:.0f} px"
    return replace(hidden, reading="\n".join(filter(None, (found.reading, said))))


class _Frames:
    """Progress of detection; nothing is shown for inputs that are read at once."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._bar: Progress | None = None

    def __enter__(self) -> _Frames:
        return self

    def __exit__(self, *failed: Any) -> None:
        if self._bar is not None:
            self._bar.__exit__(*failed)

    def __call__(self, done: float, total: float) -> None:
        if self._bar is None:
            self._bar = Progress(total, f"landmarks of {self._label}").__enter__()
        self._bar.update(done)


def is_video(path: Any) -> bool:
    """Whether an input is a video, which is then also what the overlay is drawn on."""
    return Path(path).is_file() and evidence.is_video(path)


def _lens(options: argparse.Namespace, size: tuple[int, int] | None) -> tuple[Camera | None, str]:
    if options.camera_name is not None and options.camera is None:
        raise InputError("--camera-name: found no camera file; valid: --camera FILE beside it")
    if options.camera is not None:
        if options.fov is not None:
            raise InputError("--camera: found --fov beside it; valid: one of them")
        hint = str(options.video or options.input)
        return read_camera(options.camera, name=options.camera_name, size_px=size, up=options.up, hint=hint)
    if options.fov is None:
        return None, ""
    return _pinhole(options, size), f"--fov {options.fov:g}"


def _pinhole(options: argparse.Namespace, size: tuple[int, int] | None) -> Camera:
    if size is None:
        raise InputError("--fov: found no image size; valid: --size WIDTHxHEIGHT beside it, or --video")
    focal = size[0] / 2 / math.tan(math.radians(options.fov) / 2)
    matrix = np.array([[focal, 0.0, size[0] / 2], [0.0, focal, size[1] / 2], [0.0, 0.0, 1.0]])
    return Camera(matrix, np.zeros(5), None, size)


def _video(path: Any) -> tuple[float | None, tuple[int, int] | None]:
    """Frame rate and size of a video, as far as it says; a video that can't be read is found later."""
    capture = cv2.VideoCapture(str(path))
    try:
        rate = capture.get(cv2.CAP_PROP_FPS)
        size = (int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)))
    finally:
        capture.release()
    low, high = RATE_RANGE_HZ
    return (rate if low <= rate <= high else None), (size if min(size) > 0 else None)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,5})[xX×](\d{1,5})", text)
    if found is None or "0" in found.groups():
        raise argparse.ArgumentTypeError(
            f"found {text!r}; valid: width x height in pixels, such as 1920x1080"
        )
    return int(found[1]), int(found[2])


def _place(text: str) -> tuple[float, float]:
    found = arguments.numbers(text)
    if len(found) != 2 or min(found) < 0:
        raise argparse.ArgumentTypeError(f"found {text!r}; valid: x,y in pixels, such as 640,360")
    return found[0], found[1]
