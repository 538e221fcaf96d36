"""What the user says of a file that the file itself does not, and the axes and units that follow from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.errors import InputError
from simrecon.types import Array, Camera

AXES = ("x", "y", "z", "-x", "-y", "-z")
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
FRAMES = ("world", "camera")

# A standing person's height, m: outside of it a unit is not believed.
STATURE_RANGE_M = (1.2, 2.3)
UPRIGHT_COSINE, UPRIGHT_SHARE = 0.8, 0.8


@dataclass(frozen=True)
class Options:
    """What the user says of a file; None = what the file says, or an error if it says nothing.

    Attributes:
        format: name of a reader.
        up: axis of the file that points up, one of `AXES`.
        unit: of lengths, one of `UNITS_M`.
        frame: `world` or `camera`, for files that hold both.
        person: which one, as the file names it.
        fps: frame rate, Hz.
        camera: the lens, for files with landmarks only.
    """

    format: str | None = None
    up: str | None = None
    unit: str | None = None
    frame: str | None = None
    person: str | None = None
    fps: float | None = None
    camera: Camera | None = None


def times_s(source: str, frames: Array, fps: float | None) -> Array:
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


def find_up(source: str, trunk: Array, asked: str | None) -> tuple[str, str]:
    """The axis that points up: as asked for, or that along which the trunk stands.

    Args:
        source: name of the file, for messages.
        trunk: (T, 3) from hips to neck, in the file's axes; NaN where unknown.
        asked: by the user.

    Returns:
        The axis, and how it was found.

    Raises:
        InputError: the person isn't upright along one axis for most of the time.
    """
    if asked is not None:
        return asked, "as given"
    known = trunk[np.isfinite(trunk).all(axis=-1)]
    unit = known / np.maximum(np.linalg.norm(known, axis=-1, keepdims=True), 1e-12)  # (T, 3)
    shares = {axis: _share(unit, axis) for axis in AXES}
    best = max(shares, key=lambda axis: shares[axis])
    if shares[best] < UPRIGHT_SHARE:
        found = f"a trunk that is upright along {best} in {100 * shares[best]:.0f} % of the frames"
        raise InputError(f"{source}: up axis: found {found}; valid: --up {', '.join(AXES)}")
    return best, f"the trunk stands along it in {100 * shares[best]:.0f} % of the frames"


def _share(unit: Array, axis: str) -> float:
    component = unit["xyz".index(axis[-1])] if unit.ndim == 1 else unit[:, "xyz".index(axis[-1])]
    sign = -1.0 if axis.startswith("-") else 1.0
    return float(np.mean(sign * component >= UPRIGHT_COSINE)) if len(unit) else 0.0


def find_unit(source: str, stature: float, asked: str | None, stated: str | None = None) -> tuple[str, str]:
    """The unit of length: as asked for, as the file states, or that in which the person has a person's height.

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
    return fitting[0], f"the person is {stature * UNITS_M[fitting[0]]:.2f} m tall"
