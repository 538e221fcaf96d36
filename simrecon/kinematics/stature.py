"""A fit whose body is as tall as the person is known to be."""

from __future__ import annotations

from dataclasses import replace

from simrecon import body as bodies
from simrecon.body import primitives
from simrecon.kinematics.fitting import fit
from simrecon.plan import Kinematics
from simrecon.types import Evidence, KinematicFit, Scene


def fit_to_stature(
    evidence: Evidence, scene: Scene, plan: Kinematics, request: bodies.ShapeRequest | None = None
) -> KinematicFit:
    """`fit`, repeated so that the body has the stature of the evidence.

    The fit holds the stature to first order in the logarithms of the lengths (`terms.shared.Size`). Where the
    trunk is found a fifth longer than it was measured, the body ends 1 per cent taller than the person. Where
    floor and items hold the feet, that is no matter; where one camera alone places them, it moves them away
    by 1 per cent of their distance, and down.

    Args:
        evidence: on a uniform time grid; without a stature this is `fit`.
        scene: what the person may touch.
        plan: weights and scales.
        request: the body's shape, as `fit` takes it.

    Raises:
        InputError: as `fit`.
    """
    first = fit(evidence, scene, plan, request)
    if evidence.height_m is None:
        return first
    taller = primitives.upright_m(first.body) / evidence.height_m
    again = fit(replace(evidence, height_m=evidence.height_m / taller), scene, plan, request)
    return replace(again, body=replace(again.body, height_m=evidence.height_m))
