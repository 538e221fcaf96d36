"""Chosen frames of a result as a picture: the body in its scene, with the forces on it as arrows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from simrecon.drawing import overlay, video
from simrecon.errors import InputError
from simrecon.results import Result, open_result
from simrecon.types import IntArray, Motion

WORDS = ("lowest", "highest", "hardest")
"""Frames by what happens there: lowest and highest centre of mass, greatest force of the scene."""
TILE_PX = 480


def write(
    result: Result | Path | str,
    target: Path | str,
    at: Sequence[str | float] = WORDS,
    style: str = "skin",
) -> IntArray:
    """Write a PNG of a result's frames, side by side.

    Args:
        result: opened, or its folder.
        target: file, `.png`.
        at: seconds, or one of `WORDS`, each.
        style: how the person is drawn, one of `clothed.STYLES`.

    Returns:
        The frames.

    Raises:
        InputError: the result can't be read, the file not written, or a frame is not there.
    """
    if Path(target).suffix.lower() != ".png":
        raise InputError(f"{target}: is no .png; valid: a name that ends in .png")
    opened = result if isinstance(result, Result) else open_result(result)
    motion = opened.motion
    chosen = np.array([frame(motion, str(when)) for when in at])
    video.write_image(target, overlay.sheet(opened.animation(style), tile_px=TILE_PX, frames=chosen))
    return chosen


def frame(motion: Motion, word: str) -> int:
    """The frame nearest to a time in seconds, or that of one of `WORDS`.

    Raises:
        InputError: neither, or a time outside the motion.
    """
    later = ~motion.begins  # forces at the first frame are those of an instant, not of a frame
    measures = {
        "lowest": -motion.com_m[:, 2],
        "highest": motion.com_m[:, 2],
        "hardest": np.where(later, np.linalg.norm(motion.grf_N, axis=-1), -1.0),
    }
    if word in measures:
        return int(np.where(motion.kept, measures[word], -np.inf).argmax())
    first, last = float(motion.times_s[0]), float(motion.times_s[-1])
    try:
        time = float(word)
    except ValueError:
        time = np.nan
    if not first <= time <= last:
        raise InputError(
            f"--at: found {word!r}; valid: seconds from {first:g} to {last:g}, {', '.join(WORDS)}"
        )
    return int(np.abs(motion.times_s - time).argmin())
