"""The evidence of a job: its files read as it says, and what it says of the person put in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from simrecon import evidence as readers
from simrecon import trust
from simrecon.body import ShapeRequest, model_file, names, shape
from simrecon.body.shape import ShapeSpace
from simrecon.errors import InputError
from simrecon.evidence import plausible, upright
from simrecon.evidence.camera import files, fov, hidden
from simrecon.evidence.video import frames
from simrecon.evidence.video.frames import Info
from simrecon.geometry import camera as cameras
from simrecon.job import pairs
from simrecon.job.options import Person, Reading
from simrecon.job.request import Job
from simrecon.types import Array, Camera, Evidence

Progress = Callable[[float, float], None]
"""Told how many frames of a video are done, and how many there are."""


def background(job: Job) -> str | None:
    """The video that the overlay is drawn on: an input that is one, if no other is given."""
    return job.input if job.video is None and is_video(job) else job.video


def is_video(job: Job) -> bool:
    """Whether the input is a video."""
    return Path(job.input).is_file() and readers.is_video(job.input)


def observe(job: Job, progress: Progress | None = None) -> Evidence:
    """Read and check the evidence of a job: `told` of what is `seen`.

    Args:
        job: what to do.
        progress: of the detection in a video.

    Raises:
        InputError: a file can't be used, or options that exclude each other stand side by side.
    """
    return told(job, seen(job, progress))


def seen(job: Job, progress: Progress | None = None) -> Evidence:
    """What the files hold, as the job says that they are to be read.

    Args:
        job: what to do.
        progress: of the detection in a video.

    Raises:
        InputError: a file can't be used, or options that exclude each other stand side by side.
    """
    evidence = _read(job, progress) if job.detected is None else readers.read(job.detected)
    readers.check_names(evidence, names.valid_names(), _source(job))
    return plausible.with_items(evidence, len(job.scene.items))


def told(job: Job, evidence: Evidence) -> Evidence:
    """Evidence with what the job says of the person and of its worth, without what it leaves out.

    Raises:
        InputError: nothing is left, or it can't be worth that.
    """
    evidence, person = without(evidence, job.reading.ignore, _source(job)), job.person
    if job.reading.trust is not None:
        trust.parse(job.reading.trust, "--trust")
        evidence = replace(evidence, trust=job.reading.trust)
    height_m, mass_kg = person.height_m or evidence.height_m, person.mass_kg or evidence.mass_kg
    return replace(evidence, height_m=height_m, mass_kg=mass_kg)


def _source(job: Job) -> str:
    """The file that holds the evidence."""
    return job.input if job.detected is None else job.detected


def shape_of(person: Person) -> ShapeRequest | None:
    """The body's shape, as far as it is given.

    Raises:
        InputError: betas out of range, or a body model that can't be read.
    """
    if (person.betas, person.body_model, person.mass_distribution) == (None, None, None):
        return None
    space = space_of(person)
    betas = None if person.betas is None else betas_of(person, space)
    return ShapeRequest(betas, space, person.mass_distribution or "standard")


def space_of(person: Person) -> ShapeSpace:
    """The space of the person's shape parameters: that of a body model, or simrecon's own."""
    return shape.space() if person.body_model is None else model_file.read(person.body_model)


def betas_of(person: Person, space: ShapeSpace) -> Array:
    """The person's shape parameters, checked.

    Raises:
        InputError: too many for the space, or out of range.
    """
    return shape.check(np.array(person.betas or ()), space, "--betas")


def without(evidence: Evidence, parts: tuple[str, ...], source: str) -> Evidence:
    """Evidence without its 2D landmarks (`keypoints`) or its 3D estimate (`joints`).

    Raises:
        InputError: nothing is left.
    """
    frames = len(evidence.times_s)
    if "keypoints" in parts:
        evidence = replace(
            evidence,
            keypoint_names=(),
            keypoints_px=np.empty((frames, 0, 2)),
            scores=np.empty((frames, 0)),
        )
    if "joints" in parts:
        evidence = replace(
            evidence,
            joint_names=(),
            joints_m=np.empty((frames, 0, 3)),
        )
    if parts and not evidence.keypoint_names and not evidence.joint_names:
        raise InputError(f"{source}: --ignore leaves nothing; valid: keep 2D landmarks or a 3D estimate")
    return evidence


def _read(job: Job, progress: Progress | None) -> Evidence:
    """Evidence of the input and of the landmarks that go with it."""
    reading, info = job.reading, _probe(job)
    pairs.refuse(reading)
    size_px = _size_px(job) or (None if info is None else info.size_px)
    camera, source = _lens(job, size_px, info)
    if reading.unknown_camera and camera is None and size_px is not None:
        camera, source = hidden.usual(size_px), "unknown"
    options = readers.Options(
        format=reading.format,
        up=reading.up,
        unit=reading.unit,
        height_m=job.person.height_m,
        joints=reading.joints,
        frame=reading.frame,
        person=reading.person,
        points=reading.points,
        layout=reading.layout,
        fps=reading.fps,
        video_fps=None if info is None else info.rate_hz,
        camera=camera,
        lens=source,
        size_px=size_px,
        person_at=reading.person_at_px,
        model=reading.model,
        turn_deg=reading.rotate,
        aspect=1.0 if info is None else _aspect(job, info),
        span=span(reading),
        progress=progress,
    )
    seen = readers.read(
        job.input, options, keypoints=reading.keypoints, keypoints_person=reading.keypoints_person
    )
    return _unknown(seen) if reading.unknown_camera else seen


def span(reading: Reading) -> readers.Span:
    """The part of the input that is asked for."""
    return readers.Span(reading.from_s, reading.to_s, reading.every or 1)


def _probe(job: Job) -> Info | None:
    """What the input's video says: the one that is drawn on, or in which landmarks are looked for."""
    video, keypoints = background(job), job.reading.keypoints
    if video is None and keypoints is not None and Path(keypoints).is_file() and readers.is_video(keypoints):
        video = keypoints
    return None if video is None else frames.probe(Path(video), job.reading.rotate or 0)


def _aspect(job: Job, info: Info) -> float:
    """Width of a pixel over its height in the image of landmarks that come without the video itself.

    They are of the stored image, unless the user gives its size, or evidence has another.

    Raises:
        InputError: the video is turned as well, which other programs may or may not have done.
    """
    form = info.form
    if form.aspect == 1.0 or is_video(job) or job.reading.size_px is not None:
        return 1.0
    if form.rotation_deg % 180:
        found = f"pixels {form.aspect:.4g} times as wide as high in a video that is turned"
        raise InputError(f"{job.input}: found {found}; valid: --size WIDTHxHEIGHT of the landmarks' image")
    if (own := readers.image_size_px(job.input)) is None:
        return form.aspect
    width, height = info.size_px[::-1] if form.turn_deg % 180 else info.size_px
    share = own[0] / own[1] * height / width  # 1 of square pixels
    return form.aspect if abs(share * form.aspect - 1) < abs(share - 1) else 1.0


def _size_px(job: Job) -> tuple[int, int] | None:
    """Image size, where it is needed for a lens: that of an evidence file, else what the user says."""
    reading = job.reading
    if (reading.fov_deg, reading.camera, reading.size_px) == (None, None, None):
        return None
    own = readers.image_size_px(job.input)
    if own is not None and (reading.rotate or 0) % 180:
        own = own[::-1]
    if None not in (own, reading.size_px) and own != reading.size_px:
        found, valid = ("x".join(map(str, size)) for size in (reading.size_px or (), own or ()))
        raise InputError(f"{job.input}: --size: found {found}, but the file has {valid}; valid: leave it out")
    return own or reading.size_px


def _lens(job: Job, size_px: tuple[int, int] | None, info: Info | None) -> tuple[Camera | None, str]:
    """The camera that the user names, and where it is from."""
    reading = job.reading
    if reading.camera is None:
        source = "" if reading.fov_deg is None else f"--fov {reading.fov_deg:g}"
        return fov.from_fov(reading.fov_deg, size_px), source
    hint = str(job.video or job.input)
    read = partial(files.read, reading.camera, name=reading.camera_name, up=reading.up, hint=hint)
    try:
        return read(size_px=size_px)
    except InputError:
        if info is None or info.form.aspect == 1.0 or info.form.turn_deg or info.form.rotation_deg:
            raise
    aspect = info.form.aspect  # it may be that of the stored image, whose pixels are not square
    camera, source = read(size_px=info.decoded_px)
    return upright.stretched(camera, aspect), f"{source}, of pixels {aspect:.4g} times as wide as high"


def _unknown(seen: Evidence) -> Evidence:
    """Evidence whose camera is left out, as the reading says."""
    blind = readers.unknown_camera(seen)
    if blind.camera is None:
        return blind
    first, *others = (seen.reading or "simrecon evidence").splitlines()
    focal = f"{cameras.focal_px(blind.camera.lens):.0f} px"
    first += f"; camera left out (--unknown-camera), focal length estimated with the motion, from {focal}"
    return replace(blind, reading="\n".join((first, *others)))
