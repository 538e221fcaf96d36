"""Evidence of a video."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simrecon.evidence.camera import fov, hidden
from simrecon.evidence.content import Content
from simrecon.evidence.cutting import Span
from simrecon.evidence.options import Options
from simrecon.evidence.video import detection, frames, metadata, survey, weights
from simrecon.evidence.video.blazepose import NAMES
from simrecon.evidence.video.carried import follow
from simrecon.evidence.video.detection import Look
from simrecon.evidence.video.kept import Detection
from simrecon.evidence.video.tracker import Choice
from simrecon.io.messages import counted
from simrecon.types import Array, Camera, Evidence, Part

LENSES = "--camera FILE, or --fov DEGREES across the image (many phones: 60 to 70, upright 37 to 43)"
RATE_ERROR_MAX = 0.02


def matches(content: Content) -> bool:
    """Whether the file is a video."""
    return content.kind == "video"


def read(content: Content, options: Options) -> Evidence:
    """Evidence of the landmarks of one person.

    Raises:
        InputError: no weights, no extra, a damaged video, or no such person.
    """
    info = frames.probe(content.path, options.turn_deg or 0)
    camera, lens = _lens(content, options, info)
    model = options.model or weights.best()
    detected, asked, cached = look(content, options)
    times, clock = _times(content, detected, info, options.fps)
    if len(times) < 2:
        raise content.fail("frames", "a single frame", "a video of two frames or more")
    seen, carried = detected.seen, follow(camera, detected.views)
    size = f"{info.size_px[0]} x {info.size_px[1]} px{_turned(info)}"
    reading = [
        f"{content.path.name}, {size}, {counted(len(times), 'frame')}, {clock}",
        f"lens: {lens}",
        f"BlazePose {model}{', from the cache' if cached else _speed(detected)}: "
        f"{_whom(detected, asked.choice)}",
        *_notes(detected, info, seen, times, whole=options.span.is_all),
        *carried.notes,
    ]
    return Evidence(
        times_s=times,
        keypoint_names=NAMES,
        keypoints_px=carried.in_one_lens(detected.points_px),
        scores=np.where(seen[:, None], detected.scores, 0.0).clip(0.0, 1.0),
        joint_names=NAMES,
        joints_m=detected.world_m,
        joints_frame="camera_root_relative",
        camera=carried.camera,
        ground_known=carried.camera.path is None or camera.path is not None,
        part=_part(detected, info, options.span),
        sha256=content.sha256,
        reading="; ".join(reading),
    )


def look(content: Content, options: Options) -> tuple[Detection, Look, bool]:
    """Follow one person.

    Returns:
        What was found, how it was looked for, and whether it came out of the cache.

    Raises:
        InputError: no weights, no extra, a damaged video, or no such person.
    """
    asked = Look(_choice(content, options), options.span, options.fps, options.turn_deg or 0)
    model = options.model or weights.best()
    detected, cached = detection.detect(content.path, content.sha256, model, asked, options.progress)
    return detected, asked, cached


def _lens(content: Content, options: Options, info: frames.Info) -> tuple[Camera, str]:
    if options.camera is not None:
        width, height = options.camera.lens.image_size_px
        if (width, height) != info.size_px:
            sizes = f"a camera of {width} x {height} for a video of {info.size_px[0]} x {info.size_px[1]} px"
            raise content.fail("image size", sizes, "the video's size, which needs no --size")
        return options.camera, options.lens
    focal = metadata.focal_35mm(content.path)
    if focal is None:
        return hidden.usual(info.size_px), f"not known: estimated with the motion, unless you give {LENSES}"
    pixels = metadata.focal_px(focal, info.size_px)
    text = f"{focal:g} mm equivalent as the video says, {pixels:.0f} px"
    return fov.pinhole(pixels, info.size_px), text


def _choice(content: Content, options: Options) -> Choice:
    if options.person is not None and options.person_at is not None:
        raise content.fail("--person", "--person-at beside it", "one of them")
    if options.person is None:
        return Choice(at_px=options.person_at)
    if not (options.person.isdecimal() and 1 <= int(options.person) <= detection.PEOPLE_MAX):
        raise content.fail(
            "--person", repr(options.person), "1 (the one seen best), 2, …; or --person-at X,Y; all for `run`"
        )
    return Choice(number=int(options.person))


def _times(content: Content, detected: Detection, info: frames.Info, fps: float | None) -> tuple[Array, str]:
    """Times of the frames since the video's first, and where they are from."""
    stamps, count = detected.stamps_s, len(detected.stamps_s)
    if fps is not None:
        return detected.rows / fps, f"{fps:g} Hz as given"
    intervals = np.diff(stamps)
    if count > 1 and np.isfinite(stamps).all() and (intervals > 0).all():
        mean = float(intervals.mean())
        even = float(np.abs(stamps - stamps[0] - mean * np.arange(count)).max()) < 0.25 * mean
        kind = f"{1 / mean:.4g} Hz" if even else f"variable rate, {1 / mean:.4g} Hz on average"
        return stamps, kind
    if info.rate_hz is None:
        raise content.fail("frame rate", "neither time stamps nor a rate", "--fps N")
    return detected.rows / info.rate_hz, f"{info.rate_hz:.4g} Hz (no usable time stamps)"


def _part(detected: Detection, info: frames.Info, span: Span) -> Part | None:
    """Which frames of the video these are; None: all."""
    if span.is_all:
        return None
    count = max(info.count, int(detected.rows[-1]) + 1) if info.count else 0
    return Part(int(detected.rows[0]), span.every, count)


def _turned(info: frames.Info) -> str:
    """How the stored image was made upright."""
    form, notes = info.form, []
    if form.aspect != 1.0:
        notes.append(f"pixels {form.aspect:.4g} times as wide as high made square")
    if form.rotation_deg:
        notes.append(f"turned by {form.rotation_deg}°")
    if form.turn_deg:
        notes.append(f"turned by {form.turn_deg}° as told")
    return f" ({', '.join(notes)})" if notes else ""


def _speed(detected: Detection) -> str:
    return f", {np.median(detected.frame_ms):.0f} ms a frame"


def _whom(detected: Detection, choice: Choice) -> str:
    known = survey.described(detected.sightings, len(detected.looked))
    count = len(np.unique(detected.sightings[:, 1]))
    if count < 2:
        return "one person"
    reason = "as chosen" if choice != Choice() else "seen best; --person or --person-at chooses"
    number = f"person {detected.chosen + 1}" if detected.chosen >= 0 else "another person"
    return f"{number} of {count}, {reason}: {known}"


def _notes(
    detected: Detection, info: frames.Info, seen: NDArray[np.bool_], times: Array, *, whole: bool
) -> list[str]:
    notes = []
    if not seen.all():
        notes.append(
            f"unseen in {int((~seen).sum())} of {counted(len(times), 'frame')}, "
            f"lost {counted(detected.losses, 'time')}"
        )
    if hidden := int(detected.hidden.sum()):
        notes.append(f"hidden in {counted(hidden, 'frame')}, and taken to go on as before")
    if detected.backward:
        notes.append(f"{counted(detected.backward, 'frame')} found backward in time")
    for part, number in zip(("arms", "legs"), detected.swapped.sum(axis=0), strict=True):
        if number:
            notes.append(f"left and right {part} exchanged in {counted(int(number), 'frame')}")
    if info.count > 0 and whole and len(times) < (1 - RATE_ERROR_MAX) * info.count:
        notes.append(f"only {len(times)} of {info.count} frames could be decoded")
    return notes
