"""The options that say how an input is to be read."""

from __future__ import annotations

import argparse
import re
import sys

from simrecon import evidence
from simrecon.cli import arguments
from simrecon.evidence import formats, lens
from simrecon.evidence.lens import FOV_RANGE_DEG, RATE_RANGE_HZ
from simrecon.evidence.options import AXES, FRAMES, UNITS_M
from simrecon.types import Evidence


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


def read(options: argparse.Namespace) -> Evidence:
    """Read the input, and say on stderr how it was understood."""
    rate, size = lens.probe(options.video) if options.video is not None else (None, None)
    asked = evidence.Options(
        format=options.format,
        up=options.up,
        unit=options.unit,
        frame=options.frame,
        person=options.person,
        fps=options.fps,
        video_fps=rate,
        camera=lens.from_fov(options.fov, options.size or size),
    )
    found = evidence.read(
        options.input,
        asked,
        keypoints=options.keypoints,
        keypoints_person=options.keypoints_person,
    )
    for line in found.reading.splitlines():
        print(f"read as {line}", file=sys.stderr)
    return found


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,5})[xX×](\d{1,5})", text)
    if found is None or "0" in found.groups():
        raise argparse.ArgumentTypeError(
            f"found {text!r}; valid: width x height in pixels, such as 1920x1080"
        )
    return int(found[1]), int(found[2])
