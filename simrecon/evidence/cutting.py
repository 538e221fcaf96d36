"""A part of evidence: the frames of a span of time, or every so many, with the camera of these frames."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.errors import InputError
from simrecon.geometry import camera as cameras
from simrecon.io.messages import counted
from simrecon.types import Array, Evidence, Part

TOLERANCE_S = 1e-6
"""Frames this near to an end of the span belong to it."""
LEAST_FRAMES = 2


@dataclass(frozen=True)
class Span:
    """The part of a source that is asked for, by the times of its frames.

    Attributes:
        from_s, to_s: first and last time that belong to it; None: from the first frame, to the last.
        every: of the frames in between only each so many is taken, the first one included.
    """

    from_s: float | None = None
    to_s: float | None = None
    every: int = 1

    @property
    def is_all(self) -> bool:
        """Whether nothing is left out."""
        return self == Span()

    @property
    def flags(self) -> str:
        """As it is written on a command line."""
        ends = {"--from": self.from_s, "--to": self.to_s}
        words = [f"{flag} {value:g}" for flag, value in ends.items() if value is not None]
        return " ".join(words + ([f"--every {self.every}"] if self.every > 1 else []))

    def begun(self, time_s: float) -> bool:
        """Whether a time is not before the span."""
        return self.from_s is None or time_s >= self.from_s - TOLERANCE_S

    def ended(self, time_s: float) -> bool:
        """Whether a time is behind the span."""
        return self.to_s is not None and time_s > self.to_s + TOLERANCE_S


WHOLE = Span()


def cut(seen: Evidence, frames: slice) -> Evidence:
    """The frames of a slice; `part` and reading of what is left say where they are in the source."""
    first, end, every = frames.indices(len(seen.times_s))
    before = seen.part or Part(0, 1, len(seen.times_s))
    part = Part(before.first + first * before.every, before.every * every, before.count)
    if (first, end, every) == (0, len(seen.times_s), 1):
        return seen
    return replace(
        seen,
        times_s=seen.times_s[frames],
        keypoints_px=seen.keypoints_px[frames],
        scores=seen.scores[frames],
        joints_m=seen.joints_m[frames],
        camera=None if seen.camera is None else cameras.at(seen.camera, frames),
        part=part,
    )


def within(seen: Evidence, span: Span, source: str) -> Evidence:
    """The part of evidence that lies in a span.

    Args:
        seen: whole.
        span: what to keep.
        source: where it is from, for messages.

    Raises:
        InputError: fewer than two frames lie in it.
    """
    return seen if span.is_all else cut(seen, frames(seen.times_s, span, source))


def frames(times_s: Array, span: Span, source: str) -> slice:
    """The frames of a span among increasing times (T,).

    Raises:
        InputError: they are fewer than two.
    """
    low = -np.inf if span.from_s is None else span.from_s - TOLERANCE_S
    high = np.inf if span.to_s is None else span.to_s + TOLERANCE_S
    first, end = np.searchsorted(times_s, low), np.searchsorted(times_s, high, side="right")
    there = slice(int(first), int(end), span.every)
    count = len(range(*there.indices(len(times_s))))
    if count < LEAST_FRAMES:
        raise too_few(source, span, count, (float(times_s[0]), float(times_s[-1])))
    return there


def too_few(source: str, span: Span, count: int, reach_s: tuple[float, float]) -> InputError:
    """That hardly a frame lies in a span; `reach_s`: times of the source's first and last frame."""
    found = counted(count, "frame") if count else "no frame"
    valid = f"{LEAST_FRAMES} frames or more, between {reach_s[0]:.6g} and {reach_s[1]:.6g} s"
    return InputError(f"{source}: {span.flags}: found {found} there; valid: {valid}")


def told(seen: Evidence) -> str:
    """Where the frames of evidence are in their source; nothing if they are all of it."""
    part = seen.part
    if part is None:
        return ""
    last = part.first + part.every * (len(seen.times_s) - 1)
    of = f" of {part.count}" if part.count else ""
    every = f", one of {part.every}" if part.every > 1 else ""
    return f"{seen.times_s[0]:.6g} to {seen.times_s[-1]:.6g} s, frames {part.first} to {last}{of}{every}"


def as_dict(seen: Evidence) -> dict[str, float | int | None] | None:
    """What a report says of the part; None if the evidence is all of its source."""
    if (part := seen.part) is None:
        return None
    return {
        "from_s": float(seen.times_s[0]),
        "to_s": float(seen.times_s[-1]),
        "first_frame": part.first,
        "every": part.every,
        "source_frames": part.count or None,
    }
