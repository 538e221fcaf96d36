"""What the user says of a file that the file itself does not, and the axes and units that follow from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.types import Array, Camera

AXES = ("x", "y", "z", "-x", "-y", "-z")
USUAL_AXES = ("y", "z", "-y")
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
FRAMES = ("world", "camera")

# A standing person's height, m: outside of it a unit is not believed.
STATURE_RANGE_M = (1.2, 2.3)
# An upright person is within 45 degrees of the axis; in this share of the frames, or in the other if the rest
# pose agrees.
UPRIGHT_COSINE, UPRIGHT_SHARE, UPRIGHT_REST_SHARE = np.sqrt(0.5), 0.75, 0.5


@dataclass(frozen=True)
class Options:
    """What the user says of a file; None = what the file says, or an error if it says nothing.

    Attributes:
        format: name of a reader.
        up: axis of the file that points up, one of `AXES`.
        unit: of lengths, one of `UNITS_M`.
        frame: `world` or `camera`, for files that hold both.
        person: which one, as the file names it.
        fps: frame rate, Hz; takes precedence over that of the file.
        video_fps: frame rate of the video, for files without one.
        camera: the lens, for files with landmarks only and videos; with a path of one frame where it is known
            where the camera stands.
        lens: where that is from, for the reading.
        person_at: a place in the image, x and y in pixels, where the person is; for videos.
        model: of the pose network, for videos; the best one that is there if None.
        progress: told how many frames of a video are done, and how many there are.
    """

    format: str | None = None
    up: str | None = None
    unit: str | None = None
    frame: str | None = None
    person: str | None = None
    fps: float | None = None
    video_fps: float | None = None
    camera: Camera | None = None
    lens: str = "as given"
    person_at: tuple[float, float] | None = None
    model: str | None = None
    progress: Callable[[float, float], None] | None = None

    @property
    def rate_hz(self) -> float | None:
        """The frame rate of a file that has none."""
        return self.video_fps if self.fps is None else self.fps


def place(text: str) -> tuple[float, float] | None:
    """A place in the image, pixels, from text such as `640,360`; None if it is none."""
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        return None
    return (x, y) if 0 <= x < np.inf and 0 <= y < np.inf else None


def times_s(source: str, frames: NDArray[Any], fps: float | None) -> Array:
    """Times of frame numbers (T,) at a frame rate.

    Raises:
        InputError: no frame rate.
    """
    if fps is None:
        valid = "--fps N, or --video FILE to take it from there"
        raise InputError(f"{source}: frame rate: found none in the file; valid: {valid}")
    times: Array = np.asarray(frames, float) / fps
    return times


def to_z_up(up: str) -> Array:
    """Rotation (3, 3) that turns a world whose axis `up` points up into ours, z up; x stays where it can."""
    sign = -1.0 if up.startswith("-") else 1.0
    axis = up[-1]
    if axis == "z":
        return np.diag([1.0, sign, sign])
    if axis == "y":
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -sign], [0.0, sign, 0.0]])
    return np.array([[0.0, 0.0, -sign], [0.0, 1.0, 0.0], [sign, 0.0, 0.0]])


def find_up(source: str, upright: Array, asked: str | None, rest: Array | None = None) -> tuple[str, str]:
    """The axis that points up: as asked for, or that along which the person stands.

    Only y, z and -y are taken for granted when the person stands along them: along another axis people lie.

    Args:
        source: name of the file, for messages.
        upright: (T, 3) from the ankles to the shoulders, in the file's axes; NaN where unknown.
        asked: by the user.
        rest: (3,) the same in the skeleton's rest pose, where the file has one; a person who turns over may
            be upright for less of the time if it agrees.

    Returns:
        The axis, and how it was found.

    Raises:
        InputError: the person isn't upright along one of these axes for most of the time.
    """
    if asked is not None:
        return asked, "as given"
    known = _unit(upright[np.isfinite(upright).all(axis=-1)])
    shares = {
        axis: float(np.mean(known @ _axis(axis) >= UPRIGHT_COSINE)) if len(known) else 0.0 for axis in AXES
    }
    best = max(shares, key=lambda axis: shares[axis])
    percent = f"{100 * shares[best]:.0f} % of the frames"
    usual = best in USUAL_AXES
    stands = rest is not None and float(_unit(rest) @ _axis(best)) >= UPRIGHT_COSINE
    if usual and stands and shares[best] >= UPRIGHT_REST_SHARE:
        return best, f"the person stands along it in the rest pose and in {percent}"
    if not usual or shares[best] < UPRIGHT_SHARE:
        found = f"a person who is upright along {best} in {percent}"
        raise InputError(f"{source}: up axis: found {found}; valid: --up {', '.join(AXES)}")
    return best, f"the person stands along it in {percent}"


def _axis(name: str) -> Array:
    axis = np.zeros(3)
    axis["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return axis


def _unit(vectors: Array) -> Array:
    unit: Array = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)
    return unit


def find_unit(source: str, stature: float, asked: str | None, stated: str | None = None) -> tuple[str, str]:
    """The unit of length: as asked for, as the file states, or that which gives a person's height.

    Args:
        source: name of the file, for messages.
        stature: of the person, in the file's unit.
        asked: by the user.
        stated: by the file.

    Returns:
        The unit, and how it was found.

    Raises:
        InputError: no unit, or more than one, gives a person's height; or the file's is none of ours.
    """
    if asked is not None:
        return asked, "as given"
    if stated is not None:
        unit = {"meters": "m", "metres": "m", "meter": "m", "millimeters": "mm", "centimeters": "cm"}.get(
            stated.strip().lower(), stated.strip().lower()
        )
        if unit not in UNITS_M:
            raise InputError(f"{source}: unit: found {stated!r}; valid: --unit {', '.join(UNITS_M)}")
        return unit, "as the file says"
    low, high = STATURE_RANGE_M
    fitting = [unit for unit in ("m", "cm", "mm") if low <= stature * UNITS_M[unit] <= high]
    if len(fitting) != 1:
        found = f"a person about {stature:.3g} tall"
        raise InputError(f"{source}: unit: found {found}; valid: --unit {', '.join(UNITS_M)}")
    return fitting[0], f"the person is about {stature * UNITS_M[fitting[0]]:.2f} m tall"
