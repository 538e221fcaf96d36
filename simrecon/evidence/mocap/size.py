"""How large a person of markers is, and which unit of length follows: before any offset in metres is used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simrecon.evidence.axes import STATURE_RANGE_M, UNITS_M, find_unit, metres
from simrecon.evidence.content import Content
from simrecon.evidence.mocap.labels import table
from simrecon.geometry import vectors
from simrecon.types import Array

PEOPLE_M = (0.4, 2.6)
"""A unit that the file states is not believed where it makes a person of another height."""
SIDES = ("left", "right")


@dataclass(frozen=True)
class Unit:
    """The unit of a file: its length in metres, and for the reading its name and how it was found."""

    metre: float
    name: str
    how: str


def unit(
    content: Content, points: Mapping[str, Array], choice: str | float | None, stated: str | None
) -> Unit:
    """The unit of length: as given, or as the file says if that makes a person, or else the one that does.

    Args:
        content: the file, for messages.
        points: (T, 3) by name, in the file's unit: centres of joints, or the markers nearest to them.
        choice: of the user.
        stated: by the file.

    Raises:
        InputError: no unit makes a person, or more than one does.
    """
    tall = rough(points)
    name, how = find_unit(content.source, tall, choice, stated or None)
    if choice is not None or not stated:
        return Unit(metres(name), name, how)
    if not np.isfinite(tall) or PEOPLE_M[0] <= tall * UNITS_M[name] <= PEOPLE_M[1]:
        return Unit(UNITS_M[name], name, how)
    found = f"{stated}, in which the person is about {_length(tall * UNITS_M[name])} tall"
    low, high = STATURE_RANGE_M
    fitting = [other for other in ("m", "cm", "mm") if low <= tall * UNITS_M[other] <= high]
    if len(fitting) != 1:
        valid = f"a person of {PEOPLE_M[0]:g} to {PEOPLE_M[1]:g} m, or --unit {', '.join(UNITS_M)}"
        raise content.fail("unit", found, valid)
    right = fitting[0]
    how = f"the file says {found}, and {_length(tall * UNITS_M[right])} in {right}"
    return Unit(UNITS_M[right], right, how)


def rough(points: Mapping[str, Array]) -> float:
    """Stature by shank or thigh, within some 15 %; NaN without either."""
    shares = table("stature")
    for above, below, share in (("knee", "ankle", shares["shank"]), ("hip", "knee", shares["thigh"])):
        lengths = _lengths(points, above, below)
        if lengths:
            return float(np.mean(lengths)) / float(share)
    return float("nan")


def stature_m(points: Mapping[str, Array]) -> float:
    """Stature by legs and trunk, or by legs alone; m.

    Args:
        points: (T, 3) centres of joints by name, m.
    """
    shares = table("stature")
    legs = [float(np.mean(_lengths(points, *pair))) for pair in (("hip", "knee"), ("knee", "ankle"))]
    if {"left_shoulder", "right_shoulder"} <= set(points):
        trunk = middle(points, "shoulder") - middle(points, "hip")
        if np.isfinite(trunk).all(axis=-1).any():
            long = float(np.nanmedian(np.linalg.norm(trunk, axis=-1)))
            return (sum(legs) + long) / float(shares["ankle_to_shoulder"])
    return sum(legs) / float(shares["shank"] + shares["thigh"])


def middle(points: Mapping[str, Array], joint: str) -> Array:
    """Between the left and the right one, (T, 3)."""
    between: Array = (points[f"left_{joint}"] + points[f"right_{joint}"]) / 2
    return between


def upright(points: Mapping[str, Array]) -> Array:
    """From the middle of the ankles up to the shoulders, the neck or the hips, (T, 3)."""
    top = middle(points, "hip")
    if {"left_shoulder", "right_shoulder"} <= set(points):
        top = middle(points, "shoulder")
    elif "neck" in points:
        top = points["neck"]
    return np.asarray(top - middle(points, "ankle"))


def square(direction: Array, axis: Array) -> Array:
    """The unit vector along the part of a direction that is square to a unit axis, (T, 3) each."""
    return vectors.unit(direction - np.sum(direction * axis, axis=-1, keepdims=True) * axis)


def _lengths(points: Mapping[str, Array], above: str, below: str) -> list[float]:
    """Median distance of two joints on each side where it is known, in the unit of the points."""
    pairs = [(points.get(f"{side}_{above}"), points.get(f"{side}_{below}")) for side in SIDES]
    distances = [np.linalg.norm(a - b, axis=-1) for a, b in pairs if a is not None and b is not None]
    return [float(np.nanmedian(known)) for known in distances if np.isfinite(known).any()]


def _length(metres: float) -> str:
    """A length of any size with the unit that suits it."""
    if metres < 0.01:
        return f"{1e3 * metres:.2g} mm"
    if metres < 1:
        return f"{100 * metres:.2g} cm"
    return f"{metres:.2f} m" if metres < 10 else f"{metres:.0f} m"
