"""Landmarks found frame by frame, as the evidence of one person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from simrecon.evidence.content import Content
from simrecon.evidence.keypoints import anatomy, layouts, pixels
from simrecon.evidence.keypoints.following import Detection, follow
from simrecon.evidence.options import Options, times_s
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence, IntArray


def detection(
    frame: int, points: Array, scores: Array, person: str | None = None, index: int = 0
) -> Detection:
    """A detection of points (J, 2) and scores (J,): no score above 0 is not seen, one above 1 is 1."""
    unseen = ~np.isfinite(points).all(axis=-1) | ~(scores > 0)
    points = np.where(unseen[:, None], np.nan, points)
    return Detection(frame, points, np.where(unseen, 0.0, np.clip(scores, 0.0, 1.0)), person, index)


def to_evidence(
    content: Content,
    detections: Sequence[Detection],
    names: Sequence[str] | layouts.Order,
    options: Options,
    notes: str = "",
    *,
    stamps_s: Mapping[int, float] | None = None,
    centred: bool = False,
) -> Evidence:
    """Evidence of the landmarks of one person.

    Args:
        content: the file.
        detections: of everybody in it.
        names: of the J landmarks, `""` for those to leave out; or how they are ordered.
        options: of the user.
        notes: on how the file was read.
        stamps_s: times of frames by number, where the file has them.
        centred: whether the format knows coordinates from -1 to 1.
    """
    track, how = followed(content, detections, options, centred=centred)
    text = "; ".join(part for part in (notes, how) if part)
    return of_track(content, track, names, options, text, stamps_s=stamps_s)


def followed(
    content: Content, detections: Sequence[Detection], options: Options, *, centred: bool = False
) -> tuple[list[Detection], str]:
    """The detections of one person in pixels, and what was done for it."""
    detections, scaled = pixels.in_pixels(content, detections, options, centred=centred)
    track, how = follow(content, detections, options.person)
    return track, "; ".join(part for part in (scaled, how) if part)


def of_track(
    content: Content,
    track: Sequence[Detection],
    names: Sequence[str] | layouts.Order,
    options: Options,
    notes: str = "",
    *,
    stamps_s: Mapping[int, float] | None = None,
) -> Evidence:
    """Evidence of the detections of one person, in pixels, by frame (see `to_evidence`)."""
    points = np.stack([one.points_px for one in track])  # (T, J, 2)
    scores = np.stack([one.scores for one in track])
    if isinstance(names, layouts.Order) or options.layout is not None:
        order = names if isinstance(names, layouts.Order) else layouts.Order("keypoints", ())
        names, layout = anatomy.decide(content, order, points, options.layout)
    else:
        layout = anatomy.doubt(points, names)
    keep = [i for i, name in enumerate(names) if name]
    points, scores, kept = points[:, keep], scores[:, keep], tuple(names[i] for i in keep)
    frames = np.array([one.frame for one in track])
    doubts = pixels.check(content, points, scores, options)
    parts = (f"{counted(len(keep), 'landmark')} of {len(names)}", layout, notes, numbering(frames), doubts)
    return Evidence(
        times_s=frame_times(content, frames, options, stamps_s),
        keypoint_names=kept,
        keypoints_px=points,
        scores=scores,
        joint_names=(),
        joints_m=np.empty((len(track), 0, 3)),
        joints_frame="world",
        camera=options.camera,
        sha256=content.sha256,
        reading="; ".join(part for part in parts if part),
    )


def frame_times(
    content: Content, frames: IntArray, options: Options, stamps_s: Mapping[int, float] | None
) -> Array:
    """Times (T,) of frames by number: as the file has them, or by the frame rate."""
    if stamps_s is not None and options.fps is None:
        return np.array([stamps_s[int(frame)] for frame in frames])
    return times_s(content.source, np.asarray(frames, float), options.rate_hz)


def numbering(frames: IntArray) -> str:
    """A word on frames whose numbers go in steps."""
    steps = np.diff(np.asarray(frames, int))
    step = int(np.gcd.reduce(steps)) if len(steps) > 1 else 1
    return (
        f"frames are numbered in steps of {step}: their times are those numbers over the rate"
        if step > 1
        else ""
    )
