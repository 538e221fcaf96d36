"""Points of the body that may touch: heel and toe of both feet, and what the labels say else."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simrecon import scene as scenes
from simrecon.contact.parts import HEELS, TOES, names
from simrecon.kinematics import forward
from simrecon.kinematics.contacts import ContactPoints, contact_points
from simrecon.planners.centroidal.settings import Settings
from simrecon.types import Array, Flags, IntArray, KinematicFit, Skeleton

FEET = tuple(name for side in zip(TOES, HEELS, strict=True) for name in side)
"""Left toe, left heel, right toe, right heel: the four joints of the paper."""
ROOTS = ("_hip", "_shoulder")
"""Joints that a leg or an arm hangs on."""


@dataclass(frozen=True, eq=False)
class Point:
    """One point.

    Attributes:
        name: of the part of the body that it stands for (`contact.parts`).
        segment: it is on; offset_m: (3,) in its frame.
        radius_m: by which it is off what it touches.
        anchor: segment at whose joint its limb begins; None: it is of the trunk.
        reach_m: most distance from there.
        sole: it is of a foot.
    """

    name: str
    segment: int
    offset_m: Array
    radius_m: float
    anchor: int | None
    reach_m: float
    sole: bool


def probability(fit: KinematicFit, name: str) -> Array:
    """Probability (T,) of contact of a part by the labels of a fit; 0 where they do not say."""
    if fit.contacts is None or not fit.contacts.known(name):
        return np.zeros(len(fit.times_s))
    return np.nan_to_num(fit.contacts.of(name))


def points_of(fit: KinematicFit, pose: forward.Pose, settings: Settings) -> Iterator[Point]:
    """The four of the feet, and one for each other part that is in contact anywhere."""
    touch = contact_points(fit.body.skeleton, fit.body.primitives)
    for name in (*FEET, *(name for name in names() if name not in FEET)):
        contact = probability(fit, name) >= settings.phases.contact
        rows = touch.parts[names().index(name)]
        if name in FEET:
            yield _point(fit.body.skeleton, touch, rows, name, settings)
        elif contact.any():
            lowest = _lowest(fit, pose, touch, rows, contact)
            yield _point(fit.body.skeleton, touch, lowest, name, settings)


def _lowest(
    fit: KinematicFit, pose: forward.Pose, touch: ContactPoints, rows: IntArray, frames: Flags
) -> IntArray:
    """Row of the contact point that is nearest to the scene in some frames, (1,)."""
    spheres = forward.points(pose, touch.segments[rows], touch.offsets_m[rows])[:, frames]
    apart = scenes.distances(fit.scene, spheres)[0].min(axis=0) - touch.radii_m[rows, None]  # (P, F)
    return rows[[int(np.argmin(apart.mean(axis=1)))]]


def _point(skeleton: Skeleton, touch: ContactPoints, rows: IntArray, name: str, settings: Settings) -> Point:
    """The mean of contact points of one segment."""
    segment, offset = int(touch.segments[rows[0]]), touch.offsets_m[rows].mean(axis=0)
    limb = [segment]
    while limb[-1] >= 0 and not skeleton.names[limb[-1]].endswith(ROOTS):
        limb.append(int(skeleton.parents[limb[-1]]))
    anchor = limb[-1] if limb[-1] >= 0 else None
    bones = float(np.linalg.norm(skeleton.offsets_m[limb[:-1]], axis=1).sum() + np.linalg.norm(offset))
    reach = settings.legs.trunk_m if anchor is None else bones + settings.legs.slack_m
    return Point(name, segment, offset, float(touch.radii_m[rows[0]]), anchor, reach, name in FEET)
