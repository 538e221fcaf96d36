"""The person of a fit as it was before the fit moved size and lengths, and by how much these were moved.

The skeleton of its body is s (S + Σ_l (exp(λ_l) - 1) E_l), with S as measured and E what grows with
each length. Landmarks grow with s alone, but for those of the sole, which go down. So s follows from the
landmarks, and the lengths λ from the offsets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon import body as bodies
from simrecon.body.primitives import FEET
from simrecon.kinematics import floor, person
from simrecon.kinematics.problem import drops
from simrecon.plan import Kinematics
from simrecon.trust import Trust
from simrecon.types import Array, Evidence, KinematicFit, Primitive, Skeleton

WITHIN_M = 1e-4
"""How near the skeleton comes to the fit's where it is that of the evidence."""


@dataclass(frozen=True, eq=False)
class Unscaled:
    """The person as measured, and what the fit moved.

    Attributes:
        skeleton: as measured; primitives: those of the fit at its size.
        size_sigma: how surely the stature is known (natural logarithm).
        log_scale, sole_m, lengths: as in `Variables`.
    """

    skeleton: Skeleton
    primitives: tuple[Primitive, ...]
    size_sigma: float
    log_scale: float
    sole_m: float
    lengths: Array


def unscaled(fit: KinematicFit, evidence: Evidence, plan: Kinematics, worth: Trust) -> Unscaled | None:
    """The person of a fit; None if its body isn't one of the evidence's lengths, as one of betas.

    Args:
        fit: that has ended.
        evidence: that it was made from.
        plan: whether and in which frames lengths are measured.
        worth: of the source.
    """
    known = floor.known(evidence, fit.scene, worth)
    skeleton, _, tall = person.measured(evidence, None, plan, worth, floor=known)
    ours, drop = fit.body.skeleton, drops(skeleton)
    high = ~drop.any(axis=1)
    points = skeleton.point_offsets_m
    scale = float(np.sum(ours.point_offsets_m[high] * points[high]) / np.sum(points[high] ** 2))
    sole_m = float(np.mean(scale * points[~high, 2] - ours.point_offsets_m[~high, 2]))
    stretch = bodies.length_offsets(skeleton)  # (L, SEGMENTS, 3)
    longer = ours.offsets_m / scale - skeleton.offsets_m
    factors = np.linalg.lstsq(stretch.reshape(len(stretch), -1).T, longer.ravel(), rcond=None)[0]
    off = ours.point_offsets_m - (scale * points + sole_m * drop)
    left = np.concatenate((off, longer - np.tensordot(factors, stretch, axes=1)))
    if np.abs(left).max() > WITHIN_M or factors.min() <= -1.0:
        return None
    parts = tuple(resized(part, 1.0 / scale, -sole_m / scale) for part in fit.body.primitives)
    return Unscaled(skeleton, parts, tall.sigma, float(np.log(scale)), sole_m, np.log1p(factors))


def resized(part: Primitive, scale: float, sole_m: float) -> Primitive:
    """A primitive at another scale, and a foot with its sole lower by so much."""
    points = scale * part.points_m
    if part.name in FEET:
        points = points - sole_m * np.array([0.0, 0.0, 1.0])
    return replace(part, points_m=points, size_m=scale * part.size_m)
