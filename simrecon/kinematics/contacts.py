"""Spheres that stand for the body where it may touch the scene, and what is held to a support."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from simrecon.body.primitives import FEET, entries
from simrecon.contact.parts import HEELS, SEAT, TOES
from simrecon.contact.parts import rows as part_rows
from simrecon.types import Array, ContactLabels, ContactTargets, IntArray, Primitive, Skeleton

SIGMA_TOUCH_M = 0.05
SIGMA_STAND_M, SIGMA_LEVEL_M = 0.1, 0.04
LEVEL = 0.6
"""Weight on the ground, as a share of that on items, of a foot that stands. So a sole that is a little tilted
is laid flat, and one that the evidence tilts by more is left as it is (docs/studies/standing.md). Items may
be narrower than a sole."""
# Flesh gives way, primitives don't: who is held a little deep in a seat bears on it.
SEAT_DEPTH_M = 0.02

_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""Signs of the corners of a box."""

Places = tuple[IntArray, IntArray, IntArray]
"""Supports, contact points and frames."""


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Spheres that stand for the primitives where they may touch the scene.

    Attributes:
        segments: (G,); offsets_m: (G, 3); radii_m: (G,).
        drop: (G, 3) how the point moves as the sole goes down by a metre.
        mass_share: (G,) weights whose mean of the points is the centre of mass.
        soles: (2, 4) rows of the corners of the left and the right sole: two of the heel, two of the toe.
        seat: (2, P) rows of the left and the right buttock.
        parts: rows of each part whose contact is told apart (`contact.parts`).
    """

    segments: IntArray
    offsets_m: Array
    radii_m: Array
    drop: Array
    mass_share: Array
    soles: IntArray
    seat: IntArray
    parts: tuple[IntArray, ...]


@dataclass(frozen=True, eq=False)
class Pull:
    """What is held to a support: places in an array (supports, contact points, frames), of one shape.

    Attributes:
        at: three index arrays that broadcast to the places.
        weights: of each place, or one for all.
        sigma: distance at which the pull begins to fade, m.
        depth_m: at which it rests in the support.
    """

    at: Places
    weights: Array | float
    sigma: float
    depth_m: float = 0.0


def pulls(
    touch: ContactPoints, labels: ContactLabels, clearance: Array, wished: ContactTargets | None = None
) -> tuple[Pull, ...]:
    """What rests on a support, in the manner of Gärtner 2022, eqs. 6 and 7.

    The lowest point of the body that may touch, the soles of feet that stand, other parts of which the labels
    say that they rest, and, over items, both buttocks of hips at rest. Over the ground they are left alone:
    who gets up turns over the hips (17 mm worse on one clip).

    Args:
        touch: G contact points.
        labels: of T frames.
        clearance: (S, G, T) of the points over S supports, the ground first.
        wished: which parts are not to touch, or None.
    """
    frames = np.arange(clearance.shape[2])
    soles = touch.soles.ravel()
    support = np.argmin(np.abs(clearance[:, soles]), axis=0)  # (8, T)
    corners, standing = (support, soles[:, None], frames[None]), _on_soles(labels, touch.soles.shape[1])
    return (
        Pull(lowest(np.arange(clearance.shape[1]), _allowed(touch, clearance, wished)), 1.0, SIGMA_TOUCH_M),
        Pull(corners, standing * LEVEL * (support == 0), SIGMA_LEVEL_M),
        Pull(corners, standing * (support > 0), SIGMA_STAND_M),
        *(
            Pull(lowest(rows, clearance, 1), labels.of(name), SIGMA_TOUCH_M, SEAT_DEPTH_M)
            for name, rows in zip(SEAT, touch.seat, strict=True)
            if len(clearance) > 1
        ),
        *(
            Pull(lowest(rows, clearance), np.nan_to_num(labels.of(name)), SIGMA_TOUCH_M)
            for name, rows in zip(labels.parts, touch.parts, strict=True)
            if name not in (*HEELS, *TOES, *SEAT) and labels.known(name)
        ),
    )


def _allowed(touch: ContactPoints, clearance: Array, wished: ContactTargets | None) -> Array:
    """Clearances (S, G, T), infinite of the parts that are not to touch."""
    if wished is None or not wished.free.any():
        return clearance
    allowed = clearance.copy()
    for rows, free in zip(touch.parts, wished.free.T, strict=True):
        allowed[:, rows[:, None], np.flatnonzero(free)] = np.inf
    return allowed


def _on_soles(labels: ContactLabels, corners: int) -> Array:
    """How surely each corner of both soles rests, (8, T), as a share of its foot."""
    ends = [name for side in zip(HEELS, TOES, strict=True) for name in side]
    each = np.stack([labels.of(name) for name in ends])  # (4, T)
    return np.repeat(each, corners // 2, axis=0) / corners


def lowest(rows: IntArray, clearance: Array, first: int = 0) -> Places:
    """Places of the least clearance (S, G, T) of some points over the supports from `first` on, (T,) each."""
    over = clearance[first:, rows]
    frames = np.arange(over.shape[2])
    support, row = np.unravel_index(over.reshape(-1, len(frames)).argmin(axis=0), over.shape[:2])
    return support + first, rows[row], frames


def contact_points(
    skeleton: Skeleton, primitives: tuple[Primitive, ...], *, rolling: bool = False
) -> ContactPoints:
    """Ends of the capsules and corners of the boxes.

    Args:
        skeleton: of the person.
        primitives: with their soles at sole_m = 0.
        rolling: whether soles bear at a heel and a ball that are round, and not at their corners.
    """
    segments, offsets, radii, sole, owner, mass = [], [], [], [], [], []
    for part in primitives:
        foot = part.name in FEET
        places, sizes = _spheres(part)
        if foot and rolling:
            places[::2], sizes[::2] = _rolling(part)
        segments += [skeleton.names.index(part.segment)] * len(places)
        offsets += [*places]
        radii += [*sizes]
        sole += [float(foot)] * len(places)
        owner += [part.name] * len(places)
        mass += [part.mass_kg / len(places)] * len(places)
    parts = np.array(owner)
    drop = np.outer(sole, [0.0, 0.0, -1.0])
    # corners with the lower sign of z come first in every pair
    soles = np.array([np.flatnonzero(parts == foot)[::2] for foot in FEET])
    seat = np.array([np.flatnonzero(parts == f"{side}_buttock") for side in ("left", "right")])
    return ContactPoints(
        np.array(segments),
        np.array(offsets),
        np.array(radii),
        drop,
        np.array(mass) / sum(mass),
        soles,
        seat,
        part_rows(primitives, tuple(owner)),
    )


def _spheres(part: Primitive) -> tuple[Array, Array]:
    """Centres (P, 3) and radii (P,): ends of a capsule, or corners of a box."""
    if part.kind == "capsule":
        return part.points_m, np.full(2, part.size_m[0])
    return part.points_m + _CORNERS * part.size_m, np.zeros(len(_CORNERS))


def _rolling(foot: Primitive) -> tuple[Array, Array]:
    """Centres (4, 3) and radii (4,) of heel and ball of a sole, in the order of its lower corners."""
    length, back = 2.0 * foot.size_m[0], foot.points_m[0, 0] - foot.size_m[0]
    at, radius = length * np.array([_entry(foot)["rolling"][end] for end in ("heel", "ball")]).T  # (2,) each
    places = foot.points_m + _CORNERS[::2] * foot.size_m  # (4, 3)
    places[:, 0] = back + np.repeat(at, 2)
    places[:, 2] += np.repeat(radius, 2)
    return places, np.repeat(radius, 2)


def _entry(part: Primitive) -> dict[str, Any]:
    """What `models/body/primitives.toml` says of a primitive."""
    return next(entry for entry in entries() if entry["name"] == part.name)
