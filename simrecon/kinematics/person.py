"""Who is fitted: the kinematic tree of the evidence's lengths, its shape, and its primitives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simrecon import body as bodies
from simrecon.body import primitives, shape_fit, shaped, shaped_primitives
from simrecon.kinematics import stature_prior
from simrecon.kinematics.stature_prior import Stature
from simrecon.plan import Kinematics
from simrecon.trust import Trust
from simrecon.types import Evidence, IntArray, Primitive, Skeleton


def measured(
    evidence: Evidence, request: bodies.ShapeRequest | None, plan: Kinematics, worth: Trust, *, floor: str
) -> tuple[Skeleton, bodies.Shape | None, Stature]:
    """Kinematic tree, and a shape if one is requested: betas give lengths, or measured lengths the betas.

    Args:
        evidence: gives the lengths, and stature and mass where they are known.
        request: what the shape should be; None: there is none.
        plan: whether and in which frames lengths are measured.
        worth: of the source of the evidence.
        floor: how the floor is known, one of `trust.FLOORS`.

    Returns:
        Tree, shape, and what is known of the stature.
    """
    lengths = bodies.measure(evidence, _seeds(evidence, plan.seed_frames)) if plan.shape else {}
    tall = stature_prior.settle(evidence.height_m, lengths, worth, floor=floor)
    if request is not None and request.betas is not None:
        own = shaped.make(request.betas, height_m=evidence.height_m, shapes=request.shapes)
        return own.skeleton, own, tall if evidence.height_m else replace(tall, sigma=worth.size)
    skeleton = bodies.scaled(lengths, tall.height_m)
    if request is None:
        return skeleton, None, tall
    betas = shape_fit.fit(
        lengths, height_m=evidence.height_m, mass_kg=evidence.mass_kg, shapes=request.shapes
    )
    height = evidence.height_m or bodies.stature_m(skeleton)
    return skeleton, shaped.make(betas, height_m=height, shapes=request.shapes), tall


def _seeds(evidence: Evidence, count: int) -> IntArray | None:
    """The frames with the best landmark scores on average (Gärtner 2022, section 3.4); None: all."""
    if not count or not evidence.keypoint_names:
        return None
    there = np.asarray(np.isfinite(evidence.joints_m).all(axis=2))  # (T, K)
    known = there[:, there.any(axis=0)].all(axis=1)
    mean = np.where(known, evidence.scores.mean(axis=1), -1.0)
    return np.sort(np.argsort(-mean, kind="stable")[:count])


def primitives_of(
    skeleton: Skeleton, evidence: Evidence, person: bodies.Shape | None
) -> tuple[Primitive, ...]:
    """Primitives of an unscaled skeleton: by proportions, or those of its shape."""
    height, mass = stature_and_mass(skeleton, evidence)
    if person is None:
        return primitives.make(skeleton, height, mass, 0.0)
    return shaped_primitives.make(person, skeleton, height_m=person.height_m, mass_kg=mass)


def stature_and_mass(skeleton: Skeleton, evidence: Evidence) -> tuple[float, float]:
    """Those of the evidence, else those that the skeleton makes probable; m and kg."""
    height = evidence.height_m or bodies.stature_m(skeleton)
    return height, evidence.mass_kg or primitives.default_mass_kg(height)
