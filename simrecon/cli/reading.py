"""The options that say how an input is to be read."""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from simrecon import evidence
from simrecon.cli import arguments
from simrecon.errors import InputError
from simrecon.evidence import formats, fov, hidden
from simrecon.evidence.lens import read as read_camera
from simrecon.evidence.options import AXES, FRAMES, UNITS_M, place
from simrecon.evidence.video import weights
from simrecon.system.progress import Progress
from simrecon.types import Camera, Evidence


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
    add_one(
        "--fps", type=arguments.number(fov.RATE_RANGE_HZ), metavar="HZ", help="frame rate [that of --video]"
    )
    add_one("--keypoints", metavar="FILE", help="2D landmarks that go with the 3D estimate of INPUT")
    add_one("--keypoints-person", metavar="NAME", help="the person in that file")
    add_one(
        "--fov",
        type=arguments.number(fov.FOV_RANGE_DEG),
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
    rate, size = fov.probe(options.video) if options.video is not None else (None, None)
    size = options.size or size
    camera, lens = _lens(options, size)
    if options.unknown_camera and camera is None and size is not None:
        camera, lens = hidden.usual(size), "unknown"
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
    said = f"camera: hidden, focal length {hidden.camera.lens.matrix_px[0, 0]:.0f} px"
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
    said = "" if options.fov is None else f"--fov {options.fov:g}"
    return fov.from_fov(options.fov, size), said


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,5})[xX×](\d{1,5})", text)
    if found is None or "0" in found.groups():
        raise argparse.ArgumentTypeError(
            f"found {text!r}; valid: width x height in pixels, such as 1920x1080"
        )
    return int(found[1]), int(found[2])


def _place(text: str) -> tuple[float, float]:
    found = place(text)
    if found is None:
        raise argparse.ArgumentTypeError(f"found {text!r}; valid: x,y in pixels, such as 640,360")
    return found
