"""What a user may say of an input and of the person in it: the options of every command that simulates.

Each field is an option of the command line (`flag`, or `--` and its name), a key in the manifest of a batch,
and a key of `job.toml`. None leaves it to the file, or to what is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from simrecon import trust
from simrecon.body import mass
from simrecon.evidence import formats
from simrecon.evidence.axes import AXES, UNIT_RANGE_M, UNITS_M
from simrecon.evidence.camera.fov import FOV_RANGE_DEG, RATE_RANGE_HZ
from simrecon.evidence.keypoints import layouts
from simrecon.evidence.keys import HEIGHT_RANGE_M, MASS_RANGE_KG
from simrecon.evidence.options import FRAMES, POINTS
from simrecon.evidence.video.weights import MODELS
from simrecon.io import tables

TIME_RANGE_S = (-1e6, 1e6)
EVERY_MAX = 10_000


def option(
    default: Any,
    text: str,
    *,
    bounds: tuple[float, float] | None = None,
    numbers: tuple[float, ...] | None = None,
    choices: tuple[str, ...] | None = None,
    flag: str = "",
    metavar: str | None = None,
    example: str = "",
    file: bool = False,
) -> Any:
    """A field that is an option.

    Args:
        default: of who does not give it.
        text: a line of help; ends with what holds without the option, in square brackets.
        bounds: lowest and highest number.
        numbers: the only valid ones.
        choices: all valid words.
        flag: of the command line, if it is not `--` and the name of the field.
        metavar: what stands for the value in help.
        example: of a value whose form the message of an error should show.
        file: the value is a path; in a job file relative paths begin at its folder.
    """
    low, high = bounds or (None, None)
    return tables.option(
        default,
        low=low,
        high=high,
        numbers=numbers,
        choices=choices,
        help=text,
        flag=flag,
        metavar=metavar,
        example=example,
        file=file,
    )


@dataclass(frozen=True)
class Reading:
    """`[reading]`: how the input is read, where it does not say so itself."""

    format: str | None = option(
        None, choices=formats.names(), metavar="NAME", text=f"{', '.join(formats.names())} [by content]"
    )
    up: str | None = option(
        None, choices=AXES, metavar="AXIS", text=f"axis that points up: {', '.join(AXES)}"
    )
    unit: float | str | None = option(
        None,
        bounds=UNIT_RANGE_M,
        choices=tuple(UNITS_M),
        metavar="UNIT",
        text=f"unit of lengths in the file: {', '.join(UNITS_M)}, or metres in one, such as 0.0564",
    )
    joints: tuple[str, ...] = option(
        (),
        metavar="OURS=THEIRS,…",
        text="joints of a BVH file by name, such as left_knee=Bone_12 [by their place in the hierarchy]",
    )
    frame: str | None = option(None, choices=FRAMES, text="which motion of a file that holds both [world]")
    person: str | None = option(
        None,
        metavar="NAME",
        text="which person of a file with several, as the file names them; of a video a number, or all",
    )
    points: str | None = option(
        None,
        choices=POINTS,
        text="what the points of a TRC or C3D file are: joints, or markers on the skin [by their names]",
    )
    layout: str | None = option(
        None,
        choices=layouts.all_names(),
        metavar="NAME",
        text="order of landmarks without names, such as coco_17 [by the person's proportions]",
    )
    from_s: float | None = option(
        None, bounds=TIME_RANGE_S, flag="--from", metavar="S", text="leave out what is before this time"
    )
    to_s: float | None = option(
        None, bounds=TIME_RANGE_S, flag="--to", metavar="S", text="leave out what is after this time"
    )
    every: int | None = option(
        None, bounds=(1, EVERY_MAX), metavar="N", text="take each N-th frame only, as of a slower camera [1]"
    )
    fps: float | None = option(None, bounds=RATE_RANGE_HZ, metavar="HZ", text="frame rate [that of --video]")
    keypoints: str | None = option(
        None, file=True, metavar="FILE", text="2D landmarks that go with the 3D estimate of INPUT"
    )
    keypoints_person: str | None = option(None, metavar="NAME", text="which person of that file")
    fov_deg: float | None = option(
        None, bounds=FOV_RANGE_DEG, flag="--fov", metavar="DEG", text="horizontal field of view of the camera"
    )
    size_px: tuple[int, int] | None = option(
        None,
        bounds=(16, 100_000),
        flag="--size",
        example="1920x1080",
        metavar="WxH",
        text="image size in pixels [that of --video]",
    )
    camera: str | None = option(
        None,
        file=True,
        metavar="FILE",
        text="the camera: TOML, OpenCV's YAML, or a calibration of Pose2Sim or Caliscope",
    )
    camera_name: str | None = option(None, metavar="NAME", text="which camera of that file")
    rotate: int | None = option(
        None,
        numbers=(90, 180, 270),
        metavar="DEG",
        text="90, 180 or 270: turns the image, and landmarks in it, clockwise [as the video says]",
    )
    unknown_camera: bool = option(
        False,
        text="ignore what the input says of its camera: assume a usual lens, find its place from the floor",
    )
    person_at_px: tuple[float, float] | None = option(
        None,
        bounds=(0.0, 100_000.0),
        flag="--person-at",
        example="640,360",
        metavar="X,Y",
        text="of a video: pixel of the first frame where the person is",
    )
    ignore: tuple[str, ...] = option(
        (),
        choices=("keypoints", "joints"),
        metavar="PART,…",
        text="parts of the input to leave out: keypoints (2D landmarks), joints (the 3D estimate)",
    )
    trust: str | None = option(
        None,
        metavar="SOURCE",
        text=f"how far the input is trusted: {', '.join(trust.names())}; then single values, as in "
        "world,place_m=0.05 [as its format deserves]",
    )
    model: str | None = option(
        None, choices=MODELS, text="of a video: the pose network [the best one that was fetched]"
    )


@dataclass(frozen=True)
class Person:
    """`[person]`: what is known of the person."""

    height_m: float | None = option(None, bounds=HEIGHT_RANGE_M, metavar="M", text="the person's height")
    mass_kg: float | None = option(None, bounds=MASS_RANGE_KG, metavar="KG", text="the person's mass")
    betas: tuple[float, ...] | None = option(
        None,
        metavar="B,…",
        text="shape parameters, the first ones [as measured]",
    )
    body_model: str | None = option(
        None,
        file=True,
        metavar="FILE",
        text="body model of the shape parameters: .npz or .pkl of SMPL's layout [simrecon's own]",
    )
    mass_distribution: str | None = option(
        None,
        choices=tuple(mass.distributions()),
        text="how the body's mass is distributed: as in characters of Rempe et al. 2020 [standard]",
    )
