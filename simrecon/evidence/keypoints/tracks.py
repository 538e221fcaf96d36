"""Landmarks found frame by frame, put together by person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import linear_sum_assignment

from simrecon.evidence import people
from simrecon.evidence.content import Content
from simrecon.evidence.options import Options, times_s
from simrecon.types import Array, Evidence

# No image is so wide.
PLACE_MAX_PX = 1e6
# A detection belongs to a track if its points moved less than this share of the person's size, and more after
# a gap; a track waits so many frames.
MOVE_MAX, GAP_MAX = 0.35, 30
# Tracks shorter than this share of the longest are taken for false detections.
SHORT_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class Detection:
    """One person in one frame.

    Attributes:
        frame: its number.
        points_px: (J, 2), NaN = not seen; scores: (J,) 0 to 1.
        person: what the file calls the person, or None.
        index: where the file's further values of this person are.
    """

    frame: int
    points_px: Array
    scores: Array
    person: str | None = None
    index: int = 0


def follow(
    content: Content, detections: Sequence[Detection], choice: str | None
) -> tuple[list[Detection], str]:
    """The detections of one person, by frame, and how they were found.

    Where the file doesn't say who is who, people are followed from frame to frame by the distance of their
    landmarks.

    Raises:
        InputError: nobody, or several and nobody asked for; two detections of a person in a frame.
    """
    for one in detections:
        if (np.abs(one.points_px) > PLACE_MAX_PX).any():
            text = f"a landmark {np.nanmax(np.abs(one.points_px)):.3g} px away in frame {one.frame}"
            raise content.fail("keypoints", text, f"at most {PLACE_MAX_PX:g}")
    seen = [one for one in detections if np.isfinite(one.points_px).all(axis=-1).any()]
    if all(one.person is not None for one in seen):
        grouped: dict[str, list[Detection]] = {}
        for one in seen:
            grouped.setdefault(str(one.person), []).append(one)
        how = ""
    else:
        grouped = _linked(seen)
        how = "followed by distance"
    kept, short = _long(grouped)
    frames = {name: len(track) for name, track in kept.items()}
    person = people.choose(content, frames if choice is None or choice in kept else _counts(grouped), choice)
    track = sorted(grouped[person], key=lambda one: one.frame)
    for one, other in pairwise(track):
        if one.frame == other.frame:
            text = f"person {person} twice in frame {one.frame}"
            raise content.fail("people", text, "each person once in a frame")
    notes = [people.named(frames, person)]
    if len(grouped) > 1:
        notes += [how, f"{short} short tracks left out" if short else ""]
    return track, ", ".join(note for note in notes if note)


def _counts(grouped: Mapping[str, list[Detection]]) -> dict[str, int]:
    return {name: len(track) for name, track in grouped.items()}


def _long(grouped: dict[str, list[Detection]]) -> tuple[dict[str, list[Detection]], int]:
    longest = max((len(track) for track in grouped.values()), default=0)
    kept = {name: track for name, track in grouped.items() if len(track) >= SHORT_SHARE * longest}
    return kept, len(grouped) - len(kept)


def _linked(seen: Sequence[Detection]) -> dict[str, list[Detection]]:
    """Tracks by number, by assignment of each frame's detections to the tracks so far."""
    tracks: list[list[Detection]] = []
    by_frame: dict[int, list[Detection]] = {}
    for one in seen:
        by_frame.setdefault(one.frame, []).append(one)
    for frame in sorted(by_frame):
        open_ = [track for track in tracks if frame - track[-1].frame <= GAP_MAX]
        new = by_frame[frame]
        cost = np.array([[_distance(track[-1], one) for one in new] for track in open_]).reshape(-1, len(new))
        taken: set[int] = set()
        if len(open_):
            for row, column in zip(*linear_sum_assignment(np.minimum(cost, 1e3)), strict=True):
                gap = frame - open_[row][-1].frame
                if cost[row, column] <= MOVE_MAX * min(gap, 3):
                    open_[row].append(new[column])
                    taken.add(int(column))
        tracks += [[one] for column, one in enumerate(new) if column not in taken]
    return {str(i): track for i, track in enumerate(tracks)}


def _distance(last: Detection, one: Detection) -> float:
    """Mean distance of the points that both have, as a share of the person's size."""
    both = np.isfinite(last.points_px).all(axis=-1) & np.isfinite(one.points_px).all(axis=-1)
    known = last.points_px[np.isfinite(last.points_px).all(axis=-1)]
    size = float(np.linalg.norm(np.ptp(known, axis=0)))
    if not both.any():
        return 1e3
    far = np.linalg.norm(last.points_px[both] - one.points_px[both], axis=-1).mean()
    return float(far / max(size, 1.0))


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
    names: Sequence[str],
    options: Options,
    notes: str = "",
) -> Evidence:
    """Evidence of the landmarks of one person.

    Args:
        content: the file.
        detections: of everybody in it.
        names: of the J landmarks, `""` for those to leave out.
        options: of the user.
        notes: on how the file was read.
    """
    track, how = follow(content, detections, options.person)
    keep = [i for i, name in enumerate(names) if name]
    points = np.stack([one.points_px for one in track])[:, keep]  # (T, J, 2)
    scores = np.stack([one.scores for one in track])[:, keep]
    frames = np.array([one.frame for one in track], float)
    return Evidence(
        times_s=times_s(content.source, frames, options.rate_hz),
        keypoint_names=tuple(names[i] for i in keep),
        keypoints_px=points,
        scores=scores,
        joint_names=(),
        joints_m=np.empty((len(track), 0, 3)),
        joints_frame="world",
        camera=options.camera,
        sha256=content.sha256,
        reading="; ".join(part for part in (f"{len(keep)} landmarks of {len(names)}", notes, how) if part),
    )
