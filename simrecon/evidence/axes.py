"""The up axis and the unit of length of a file: as the user or the file has them, or as a person fits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simrecon.errors import InputError
from simrecon.geometry import vectors
from simrecon.types import Array

AXES = ("x", "y", "z", "-x", "-y", "-z")
USUAL_AXES = ("y", "z", "-y")
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}

UNIT_RANGE_M = (1e-6, 1e3)
"""Metres in a unit that a user may say."""
GUESSED = ("m", "cm", "mm")
NUMBERS = "or metres in one, such as 0.0564"
WORDS = {
    "meters": "m", "metres": "m", "meter": "m", "metre": "m", "millimeters": "mm", "centimeters": "cm",
    "inch": "in", "inches": "in", "foot": "ft", "feet": "ft",
}  # fmt: skip
"""Other names of units in files."""

# A standing person's height, m: outside of it a unit is not believed.
STATURE_RANGE_M = (1.2, 2.3)
HEIGHT_SHARE = 0.15
"""A height that somebody says may differ by this share from what a unit that fits makes of the person."""

# An upright person is within 45 degrees of the axis. What speaks for an axis: the share of the frames in
# which the person is upright along it, a rest pose that stands along it, and lowest points that stay at the
# file's zero while the person is upright, or at least at all. A rest pose that stands on its head speaks
# against it.
UPRIGHT_COSINE = np.sqrt(0.5)
REST_VOTE, FLOOR_VOTE, LOW_VOTE = 0.5, 0.5, 0.25
ENOUGH, MARGIN = 0.75, 0.2
SELDOM = 0.05  # of the frames, in which nobody needs to be upright
FLOOR_SPREAD, FLOOR_HEIGHT = (
    0.1,
    0.15,
)  # of the person's length, quartiles of the lowest points, and their middle


def to_z_up(up: str) -> Array:
    """Rotation (3, 3) that turns a world whose axis `up` points up into ours, z up; x stays where it can."""
    sign = -1.0 if up.startswith("-") else 1.0
    axis = up[-1]
    if axis == "z":
        return np.diag([1.0, sign, sign])
    if axis == "y":
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -sign], [0.0, sign, 0.0]])
    return np.array([[0.0, 0.0, -sign], [0.0, 1.0, 0.0], [sign, 0.0, 0.0]])


def find_up(
    source: str,
    upright: Array,
    choice: str | None,
    rest: Array | None = None,
    joints: Array | None = None,
) -> tuple[str, str]:
    """The axis that points up: as the user says, or that along which the person stands.

    Only y, z and -y are taken for granted: along another axis people lie. A person who turns over stands
    along it for less of the time; then the rest pose tells, and the floor.

    Args:
        source: name of the file, for messages.
        upright: (T, 3) from the ankles to the shoulders, in the file's axes; NaN where unknown.
        choice: of the user.
        rest: (3,) the same in the skeleton's rest pose, where that is one of a person who stands.
        joints: (T, K, 3) what may touch the floor.

    Returns:
        The axis, and how it was found.

    Raises:
        InputError: too little speaks for one of these axes, or for more than one.
    """
    if choice is not None:
        return choice, "as given"
    there = np.isfinite(upright).all(axis=-1)
    known = vectors.unit(upright[there])
    if not len(known):
        raise InputError(f"{source}: up axis: found no frame with ankles and shoulders; valid: {_axes()}")
    along = {axis: known @ vector(axis) >= UPRIGHT_COSINE for axis in AXES}
    shares = {axis: float(np.mean(along[axis])) for axis in AXES}
    stands = {axis: 0.0 if rest is None else float(vectors.unit(rest) @ vector(axis)) for axis in AXES}
    votes = dict(shares)
    floors = dict.fromkeys(AXES, 0.0)
    for axis in AXES:
        votes[axis] += REST_VOTE * np.sign(stands[axis]) * (abs(stands[axis]) >= UPRIGHT_COSINE)
        if joints is not None:
            size = float(np.median(np.linalg.norm(upright[there], axis=-1)))
            floors[axis] = _floor(joints[there] @ vector(axis), along[axis], size)
            votes[axis] += floors[axis]
    best, second = sorted(AXES, key=lambda axis: -votes[axis])[:2]
    percent = f"{100 * shares[best]:.0f} % of the frames"
    if best not in USUAL_AXES or votes[best] < ENOUGH or votes[best] < votes[second] + MARGIN:
        found = f"a person who is upright along {best} in {percent}"
        raise InputError(f"{source}: up axis: found {found}; valid: {_axes()}")
    in_rest = "in the rest pose and " if stands[best] >= UPRIGHT_COSINE else ""
    floor = ", the floor is at its zero" if floors[best] and shares[best] < ENOUGH else ""
    return best, f"the person stands along it {in_rest}in {percent}{floor}"


def _axes() -> str:
    return f"--up {', '.join(AXES)}"


def _floor(heights: Array, along: NDArray[np.bool_], size: float) -> float:
    """What the lowest of heights (T, K) say for an axis; `size`: from ankles to shoulders."""
    seldom = float(np.mean(along)) < SELDOM
    rows = heights if seldom else heights[along]
    rows = rows[np.isfinite(rows).any(axis=-1)]
    if not len(rows):
        return 0.0
    low, middle, high = np.quantile(np.nanmin(rows, axis=-1), (0.25, 0.5, 0.75))
    if high - low > FLOOR_SPREAD * size or abs(middle) > FLOOR_HEIGHT * size:
        return 0.0
    return LOW_VOTE if seldom else FLOOR_VOTE


def vector(name: str) -> Array:
    """Unit vector (3,) of an axis."""
    axis = np.zeros(3)
    axis["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return axis


def metres(unit: str) -> float:
    """Metres in a unit that `find_unit` names."""
    return UNITS_M[unit] if unit in UNITS_M else float(unit.removesuffix(" m"))


def find_unit(
    source: str,
    stature: float,
    choice: str | float | None,
    stated: str | None = None,
    height_m: float | None = None,
) -> tuple[str, str]:
    """The unit of length: as the user says, as the file states, or that which gives a person's height.

    Args:
        source: name of the file, for messages.
        stature: of the person, in the file's unit.
        choice: of the user: a name, or metres in one.
        stated: by the file.
        height_m: of the person, where the user says it.

    Returns:
        The unit (`metres`), and how it was found.

    Raises:
        InputError: no unit, or more than one, gives a person's height; or the file's is none of ours.
    """
    if choice is not None:
        return (choice if isinstance(choice, str) else f"{choice:.6g} m"), "as given"
    valid = f"--unit {', '.join(UNITS_M)}, {NUMBERS}"
    if stated is not None:
        word = stated.strip().lower()
        unit = WORDS.get(word, word)
        if unit not in UNITS_M:
            raise InputError(f"{source}: unit: found {stated!r}; valid: {valid}")
        return unit, "as the file says"
    if height_m is not None and stature > 0:
        for unit in GUESSED:
            if abs(stature * UNITS_M[unit] / height_m - 1) <= HEIGHT_SHARE:
                return unit, f"the person is {stature * UNITS_M[unit]:.2f} m tall, {height_m:g} m as given"
        return f"{height_m / stature:.6g} m", f"the person is {height_m:g} m tall, as given"
    low, high = STATURE_RANGE_M
    fitting = [unit for unit in GUESSED if low <= stature * UNITS_M[unit] <= high]
    if len(fitting) != 1:
        tall = f"a person about {stature:.3g} tall"
        raise InputError(f"{source}: unit: found {tall}; valid: {valid}, or --height-m")
    return fitting[0], f"the person is about {stature * UNITS_M[fitting[0]]:.2f} m tall"
