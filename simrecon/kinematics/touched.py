"""Which parts of a posed body touch what is around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon import scene as scenes
from simrecon.contact import rules, wishes
from simrecon.contact.parts import names
from simrecon.kinematics import forward
from simrecon.kinematics.contacts import contact_points
from simrecon.kinematics.layout import from_qpos
from simrecon.types import Array, Body, ContactLabels, ContactTargets, Scene


@dataclass(frozen=True, eq=False)
class Touched:
    """P parts of a body (`contact.parts`), T frames.

    Attributes:
        clearance_m: (T, P) signed distance of the lowest point of each from what is nearest, negative inside.
        speed_mps: (T, P) of the slowest of its points that are about as low, by the frame it arrives at; the
            first frame has that of the second.
        up: (T, P, 3) unit vectors away from what is nearest to each.
    """

    clearance_m: Array
    speed_mps: Array
    up: Array


def touched(body: Body, scene: Scene, qpos: Array, times_s: Array) -> Touched:
    """How near each part is to floor and items, and how fast it moves.

    Args:
        body: of the person.
        scene: with its items where they stand.
        qpos: (T, 7 + 4 * 16) configurations of the person.
        times_s: (T,) increasing.
    """
    root, base, rotvecs = from_qpos(qpos)
    touch = contact_points(body.skeleton, body.primitives)
    pose = forward.forward(body.skeleton, root, base, rotvecs, 1.0)
    points = forward.points(pose, touch.segments, touch.offsets_m)  # (G, T, 3)
    clearance, up = _nearest(scene, points)
    clearance -= touch.radii_m[:, None]
    step = np.linalg.norm(np.diff(points, axis=1), axis=-1) / np.diff(times_s)  # (G, T - 1)
    speed = np.concatenate((step[:, :1], step), axis=1)
    near = [clearance[rows] < clearance[rows].min(axis=0) + rules.NEAR_M for rows in touch.parts]
    slow = [
        np.where(own, speed[rows], np.inf).min(axis=0) for own, rows in zip(near, touch.parts, strict=True)
    ]
    frames = np.arange(len(qpos))
    lowest = [rows[clearance[rows].argmin(axis=0)] for rows in touch.parts]
    return Touched(
        np.stack([clearance[row, frames] for row in lowest], axis=1),
        np.stack(slow, axis=1),
        np.stack([up[row, frames] for row in lowest], axis=1),
    )


def _nearest(scene: Scene, points_m: Array) -> tuple[Array, Array]:
    """Distance (G, T) of points (G, T, 3) from what is nearest to each, and its gradient (G, T, 3)."""
    apart, up = scenes.distances(scene, points_m)
    own = apart.argmin(axis=0)[None]
    return (
        np.take_along_axis(apart, own, axis=0)[0],
        np.take_along_axis(up, own[..., None], axis=0)[0],
    )


def labels(found: Touched, resting: ContactLabels | None, asked: ContactTargets | None) -> ContactLabels:
    """How surely each part touches: as near as it is, as far as it rests, and as a user wishes.

    Args:
        found: of the posed body.
        resting: what is known of the parts from the evidence; None, and NaN in it: nothing.
        asked: wishes, or None.
    """
    sure = rules.touching(found.clearance_m)
    if resting is not None:
        sure = np.where(np.isnan(resting.probability), sure, sure * resting.probability)
    source = "poses" if resting is None else resting.source
    return wishes.over(ContactLabels(names(), sure, source), asked)
