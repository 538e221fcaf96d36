"""Who is who from frame to frame: by the file's own names, or by distance where they can't be right."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from simrecon.evidence import people
from simrecon.evidence.content import Content
from simrecon.io.messages import counted
from simrecon.types import Array

# A detection belongs to a track if its points moved less than this share of the person's size, and more after
# a gap; a track waits so many frames.
MOVE_MAX, GAP_MAX = 0.35, 30
# Tracks shorter than this share of the longest are taken for false detections.
SHORT_SHARE = 0.1
# Names that stand for a frame each are no names of people. Nor are those that go further from one frame to
# the next than people do: this multiple of what is usual, or there and back, or to where another name was.
TRACK_MIN, JUMP_MIN = 2.0, 8.0
SAME_PX = 0.5

Tracks = dict[str, list["Detection"]]


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

    Where the file doesn't say who is who, or says so in a way that can't be, people are followed from frame
    to frame by the distance of their landmarks. What is in the file twice counts once, and people without any
    landmark don't count.

    Raises:
        InputError: nobody, or several and nobody asked for.
    """
    seen = [one for one in detections if np.isfinite(one.points_px).all(axis=-1).any()]
    empty = len(detections) - len(seen)
    seen, twice = _once(seen)
    notes = [f"{counted(empty, 'person', 'people')} without landmarks left out"] if empty else []
    notes += [f"{twice} detections that are there twice left out"] if twice else []
    grouped = _named(seen)
    reason = _doubt(grouped)
    if grouped is None or reason:
        grouped = linked(seen)
        notes += [f"{reason}: not used"] if reason else []
        how = "followed by distance"
    else:
        how = ""
    kept, short = _long(grouped)
    frames = {name: len(track) for name, track in kept.items()}
    person = people.choose(content, frames if choice is None or choice in kept else _counts(grouped), choice)
    track = sorted(grouped[person], key=lambda one: one.frame)
    notes.append(people.named(frames, person))
    if len(grouped) > 1:
        notes += [how, f"{short} short tracks left out" if short else ""]
    return track, ", ".join(note for note in notes if note)


def linked(seen: Sequence[Detection]) -> Tracks:
    """Tracks by number, by assignment of each frame's detections to the tracks so far."""
    tracks: list[list[Detection]] = []
    by_frame: dict[int, list[Detection]] = {}
    for one in seen:
        by_frame.setdefault(one.frame, []).append(one)
    for frame in sorted(by_frame):
        open_ = [track for track in tracks if frame - track[-1].frame <= GAP_MAX]
        new = by_frame[frame]
        cost = np.array([[distance(track[-1], one) for one in new] for track in open_]).reshape(-1, len(new))
        taken: set[int] = set()
        if len(open_):
            for row, column in zip(*scipy.optimize.linear_sum_assignment(np.minimum(cost, 1e3)), strict=True):
                gap = frame - open_[row][-1].frame
                if cost[row, column] <= MOVE_MAX * min(gap, 3):
                    open_[row].append(new[column])
                    taken.add(int(column))
        tracks += [[one] for column, one in enumerate(new) if column not in taken]
    return {str(i): track for i, track in enumerate(tracks)}


def distance(last: Detection, one: Detection) -> float:
    """Mean distance of the points that both have, as a share of the person's size."""
    both = np.isfinite(last.points_px).all(axis=-1) & np.isfinite(one.points_px).all(axis=-1)
    known = last.points_px[np.isfinite(last.points_px).all(axis=-1)]
    size = float(np.linalg.norm(np.ptp(known, axis=0)))
    if not both.any():
        return 1e3
    far = np.linalg.norm(last.points_px[both] - one.points_px[both], axis=-1).mean()
    return float(far / max(size, 1.0))


def _named(seen: Sequence[Detection]) -> Tracks | None:
    """Tracks by the file's names of people, None where somebody has none."""
    if not all(one.person is not None for one in seen):
        return None
    grouped: Tracks = {}
    for one in sorted(seen, key=lambda one: one.frame):
        grouped.setdefault(str(one.person), []).append(one)
    return grouped


def _doubt(grouped: Tracks | None) -> str:
    """Why the names can't be those of people; `""` if they can."""
    if not grouped:
        return ""
    for name, track in grouped.items():
        if any(one.frame == other.frame for one, other in pairwise(track)):
            return f"ids that stand for several people at once ({name})"
    frames = {one.frame for track in grouped.values() for one in track}
    if len(frames) > 2 and np.median([len(track) for track in grouped.values()]) < TRACK_MIN:
        return "ids that change from frame to frame"
    for name, track in grouped.items():
        ways = _ways(track)
        if not (ways > MOVE_MAX).any():
            continue
        usual = float(np.median(ways[ways <= MOVE_MAX])) if (ways <= MOVE_MAX).any() else np.inf
        others = [one for other, rest in grouped.items() if other != name for one in rest]
        pieces = _long(linked([*track, *others]))[0].values()
        mine = [piece for piece in pieces if any(one.person == track[0].person for one in piece)]
        apart = len(mine) > 1 and (_interleave(mine) or ways.max() > JUMP_MIN * usual)
        if apart or any(_is_shared(piece) for piece in pieces):
            return f"ids that go from one person to another ({name})"
    return ""


def _ways(track: Sequence[Detection]) -> Array:
    """How far it is from one frame to the next, in sizes of the person."""
    ways = [distance(one, other) for one, other in pairwise(track) if other.frame == one.frame + 1]
    return np.array([way for way in ways if way < 1e3])


def _interleave(pieces: Sequence[Sequence[Detection]]) -> bool:
    """Whether one of some tracks goes on after another has begun."""
    spans = sorted((piece[0].frame, piece[-1].frame) for piece in pieces)
    return any(one[1] > other[0] for one, other in pairwise(spans))


def _is_shared(track: Sequence[Detection]) -> bool:
    """Whether two names of the file share a track that goes on without a jump."""
    names = [one.person for one in track]
    return sum(names.count(name) >= SHORT_SHARE * len(names) for name in set(names)) > 1


def _once(seen: Sequence[Detection]) -> tuple[list[Detection], int]:
    """Each detection once, however often a frame has it."""
    kept: dict[int, list[Detection]] = {}
    for one in seen:
        others = kept.setdefault(one.frame, [])
        if not any(_same(one, other) for other in others):
            others.append(one)
    listed = [one for frame in kept.values() for one in frame]
    return listed, len(seen) - len(listed)


def _same(one: Detection, other: Detection) -> bool:
    if one.points_px.shape != other.points_px.shape:
        return False
    return bool(np.allclose(one.points_px, other.points_px, rtol=0.0, atol=SAME_PX, equal_nan=True))


def _counts(grouped: Mapping[str, list[Detection]]) -> dict[str, int]:
    return {name: len(track) for name, track in grouped.items()}


def _long(grouped: Tracks) -> tuple[Tracks, int]:
    longest = max((len(track) for track in grouped.values()), default=0)
    kept = {name: track for name, track in grouped.items() if len(track) >= SHORT_SHARE * longest}
    return kept, len(grouped) - len(kept)
