"""What is planned for: the person of a fit as one body with points that may touch (Rempe 2020, B.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.kinematics.layout import from_qpos
from simrecon.planners.centroidal import euler, labelling, touching
from simrecon.planners.centroidal.euler import Axes
from simrecon.planners.centroidal.points import Point, points_of
from simrecon.planners.centroidal.settings import Settings
from simrecon.planners.centroidal.touching import Touching
from simrecon.planners.soft_contact.masses import Masses
from simrecon.types import Array, KinematicFit

SMOOTH_S = 0.03
"""Of the limbs, before their velocity is taken."""


@dataclass(frozen=True, eq=False)
class Target:
    """A point, where it is in the input, and when it touches what.

    Attributes:
        point: on the body.
        place_m: (T, 3) in the input.
        anchor_m: (T, 3) what it hangs on (hip, shoulder, or its own place), from the centre of mass, on the
            axes of the root.
        touching: its phases, and what is around it.
    """

    point: Point
    place_m: Array
    anchor_m: Array
    touching: Touching


@dataclass(frozen=True, eq=False)
class Inputs:
    """All inputs (section 3.1), T frames.

    Attributes:
        times_s: (T,) since the first frame.
        com_m: (T, 3); turn_rad: (T, 3) Euler angles of the root about `axes`.
        inertia: (T, 3, 3) about the centre of mass, kg m², on the axes of the root.
        swing: (T, 3) angular momentum of limbs against the root, kg m²/s, on its axes.
        mass_kg: of the person.
        targets: of the points.
        pairs: (heel, toe) rows of targets on one foot, whose distance stays.
        notes: what was taken otherwise than the labels say.
    """

    times_s: Array
    com_m: Array
    turn_rad: Array
    axes: Axes
    inertia: Array
    swing: Array
    mass_kg: float
    targets: tuple[Target, ...]
    pairs: tuple[tuple[int, int], ...]
    notes: tuple[str, ...]

    @property
    def frame_s(self) -> float:
        """Time from a frame to the next."""
        return float(self.times_s[1] - self.times_s[0])


def inputs(fit: KinematicFit, settings: Settings) -> Inputs:
    """Those of a kinematic fit."""
    root, base, rotvecs = from_qpos(fit.qpos)
    skeleton, masses = fit.body.skeleton, Masses.of(fit.body)
    pose = forward.forward(skeleton, root, base, rotvecs, 1.0)
    places = forward.points(pose, masses.segments, masses.offsets_m)  # (N, T, 3)
    com = masses.centre_m(places)
    axes = pose.axes[0]  # (T, 3, 3)
    turn, order = euler.angles(axes)
    times = fit.times_s - fit.times_s[0]
    points = list(points_of(fit, pose, settings))
    segments, offsets = np.array([p.segment for p in points]), np.stack([p.offset_m for p in points])
    own = forward.points(pose, segments, offsets)  # (P, T, 3)
    near = [touching.around(fit.scene, point, place) for point, place in zip(points, own, strict=True)]
    apart = np.stack([entry[0].min(axis=0) for entry in near])  # (P, T)
    flags, notes = labelling.contacts(fit, points, apart, own, com, settings.phases)
    targets = []
    for point, place, around, contact in zip(points, own, near, flags, strict=True):
        hung = place if point.anchor is None else pose.origins_m[point.anchor]
        found = touching.touching(fit.scene, point, around, place, contact, times, settings.phases.shortest_s)
        targets.append(Target(point, place, _on_axes(axes, hung - com), found))
    pairs = [
        (i, j)
        for i, a in enumerate(targets)
        for j, b in enumerate(targets)
        if i < j and a.point.segment == b.point.segment and a.point.sole and b.point.sole
    ]
    return Inputs(
        times, com, turn, order, _inertia(masses, places - com, axes),
        _swing(masses, places - com, axes, float(times[1])), masses.total_kg,
        tuple(targets), tuple(pairs), tuple(notes),
    )  # fmt: skip


def _on_axes(axes: Array, vectors: Array) -> Array:
    """World vectors (T, 3) on the axes (T, 3, 3) of the root."""
    return np.asarray(np.einsum("tji,tj->ti", axes, vectors))


def _swing(masses: Masses, arms_m: Array, axes: Array, frame_s: float) -> Array:
    """Σ m a × ȧ on the axes of the root, with velocities of arms (N, T, 3) there, (T, 3)."""
    local = np.einsum("tji,ntj->nti", axes, arms_m)  # who turns as a whole does not move here
    local = gaussian_filter1d(local, SMOOTH_S / frame_s, axis=1, mode="nearest")
    velocity = np.gradient(local, frame_s, axis=1)
    return np.asarray(np.einsum("n,nti->ti", masses.mass_kg, forward.cross(local, velocity)))


def _inertia(masses: Masses, arms_m: Array, axes: Array) -> Array:
    """Σ m [a]ₓᵀ [a]ₓ of arms (N, T, 3), on the axes of the root, (T, 3, 3)."""
    crossed = rotations.skew(np.einsum("tji,ntj->nti", axes, arms_m))  # (N, T, 3, 3)
    return np.asarray(np.einsum("n,ntji,ntjk->tik", masses.mass_kg, crossed, crossed))
