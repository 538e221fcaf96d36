"""The up axis and the unit of length of a file: as the user or the file has them, or as a person fits."""

from __future__ import annotations

import numpy as np

from simrecon.errors import InputError
from simrecon.geometry import vectors
from simrecon.types import Array

AXES = ("x", "y", "z", "-x", "-y", "-z")
USUAL_AXES = ("y", "z", "-y")
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}

# A standing person's height, m: outside of it a unit is not believed.
STATURE_RANGE_M = (1.2, 2.3)
# An upright person is within 45 degrees of the axis; in this share of the frames, or in the other if the rest
# pose agrees.
UPRIGHT_COSINE, UPRIGHT_SHARE, UPRIGHT_REST_SHARE = np.sqrt(0.5), 0.75, 0.5


def to_z_up(up: str) -> Array:
    """Rotation (3, 3) that turns a world whose axis `up` points up into ours, z up; x stays where it can."""
    sign = -1.0 if up.startswith("-") else 1.0
    axis = up[-1]
    if axis == "z":
        return np.diag([1.0, sign, sign])
    if axis == "y":
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -sign], [0.0, sign, 0.0]])
    return np.array([[0.0, 0.0, -sign], [0.0, 1.0, 0.0], [sign, 0.0, 0.0]])


def find_up(source: str, upright: Array, choice: str | None, rest: Array | None = None) -> tuple[str, str]:
    """The axis that points up: as the user says, or that along which the person stands.

    Only y, z and -y are taken for granted when the person stands along them: along another axis people lie.

    Args:
        source: name of the file, for messages.
        upright: (T, 3) from the ankles to the shoulders, in the file's axes; NaN where unknown.
        choice: of the user.
        rest: (3,) the same in the skeleton's rest pose, where the file has one; a person who turns over may
            be upright for less of the time if it agrees.

    Returns:
        The axis, and how it was found.

    Raises:
        InputError: the person isn't upright along one of these axes for most of the time.
    """
    if choice is not None:
        return choice, "as given"
    known = vectors.unit(upright[np.isfinite(upright).all(axis=-1)])
    shares = {
        axis: float(np.mean(known @ vector(axis) >= UPRIGHT_COSINE)) if len(known) else 0.0 for axis in AXES
    }
    best = max(shares, key=lambda axis: shares[axis])
    percent = f"{100 * shares[best]:.0f} % of the frames"
    usual = best in USUAL_AXES
    stands = rest is not None and float(vectors.unit(rest) @ vector(best)) >= UPRIGHT_COSINE
    if usual and stands and shares[best] >= UPRIGHT_REST_SHARE:
        return best, f"the person stands along it in the rest pose and in {percent}"
    if not usual or shares[best] < UPRIGHT_SHARE:
        upright_along = f"a person who is upright along {best} in {percent}"
        raise InputError(f"{source}: up axis: found {upright_along}; valid: --up {', '.join(AXES)}")
    return best, f"the person stands along it in {percent}"


def vector(name: str) -> Array:
    """Unit vector (3,) of an axis."""
    axis = np.zeros(3)
    axis["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return axis


def find_unit(source: str, stature: float, choice: str | None, stated: str | None = None) -> tuple[str, str]:
    """The unit of length: as the user says, as the file states, or that which gives a person's height.

    Args:
        source: name of the file, for messages.
        stature: of the person, in the file's unit.
        choice: of the user.
        stated: by the file.

    Returns:
        The unit, and how it was found.

    Raises:
        InputError: no unit, or more than one, gives a person's height; or the file's is none of ours.
    """
    if choice is not None:
        return choice, "as given"
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
        tall = f"a person about {stature:.3g} tall"
        raise InputError(f"{source}: unit: found {tall}; valid: --unit {', '.join(UNITS_M)}")
    return fitting[0], f"the person is about {stature * UNITS_M[fitting[0]]:.2f} m tall"
