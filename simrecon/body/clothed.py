"""The skin of a person on their own kinematic tree: in a relaxed stance, with weights, ready to be posed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simrecon.body import shape, shape_fit
from simrecon.body.lengths import measure_template
from simrecon.body.shape import ShapeSpace
from simrecon.types import Array, Body, IntArray, Skeleton

STYLES = ("skin", "primitives")
"""How a person is drawn."""
_STRETCH = (0.7, 1.4)
"""Least and most by which a part of the skin is drawn out to the length of its bone."""
_DIGITS = 5
"""Of metres and kilograms that tell two people apart: a body that was written and read again is the same."""


@dataclass(frozen=True, eq=False)
class Skin:
    """A skin in the relaxed stance of the shape space. V vertices, F faces, S segments.

    Posed, v' = Σ_s w_s (R_s R_s⁰ᵀ (v - o_s⁰) + o_s) with the segments' places o and orientations R, ⁰ in the
    relaxed stance.

    Attributes:
        vertices_m: (V, 3), x forward, y left, z up; the pelvis at the origin.
        faces: (F, 3), counter-clockwise seen from outside.
        weights: (V, S), rows sum to 1.
        origins_m: (S, 3) of the segments; axes: (S, 3, 3) their orientations.
    """

    vertices_m: Array
    faces: IntArray
    weights: Array
    origins_m: Array
    axes: Array

    def strongest(self, count: int) -> tuple[IntArray, Array]:
        """The `count` segments that move each vertex most, (V, K), and weights whose rows sum to 1."""
        rows = np.argsort(-self.weights, axis=1, kind="stable")[:, :count]
        weights = np.take_along_axis(self.weights, rows, axis=1)
        return rows, np.asarray(weights / weights.sum(axis=1, keepdims=True))


def skin(body: Body) -> Skin:
    """The skin of a person, of simrecon's own shape space, drawn out to the lengths of their bones.

    Args:
        body: whose betas are taken if they are of that space; else those that fit lengths, height and mass.
    """
    space = shape.space()
    betas = _betas(body, space)
    scale = body.height_m / shape.stature_m(betas, space)
    before_m, axes = space.frames(betas)  # (S, 3), (S, 3, 3)
    before_m = scale * before_m
    origins_m = _origins(body.skeleton, axes)
    local = np.einsum("sji,vsj->vsi", axes, scale * space.vertices_m(betas)[:, None] - before_m)  # (V, S, 3)
    local *= _stretch(body.skeleton, before_m, axes)
    placed = np.einsum("sij,vsj->vsi", axes, local) + origins_m
    vertices_m = np.einsum("vs,vsi->vi", space.weights, placed)
    return Skin(vertices_m, space.faces, space.weights, origins_m, axes)


def _betas(body: Body, space: ShapeSpace) -> Array:
    if body.shape_space == space.name and len(body.betas) == space.size:
        return body.betas
    lengths_m = tuple(
        (name, round(length_m, _DIGITS)) for name, length_m in measure_template(body.skeleton).items()
    )
    return _probable(lengths_m, round(body.height_m, _DIGITS), round(body.mass_kg, _DIGITS))


@lru_cache(maxsize=16)
def _probable(lengths_m: tuple[tuple[str, float], ...], height_m: float, mass_kg: float) -> Array:
    """Betas of simrecon's shape space for lengths, height and mass, kept because a run draws them twice."""
    return shape_fit.fit(dict(lengths_m), height_m=height_m, mass_kg=mass_kg)


def _origins(skeleton: Skeleton, axes: Array) -> Array:
    """Places (S, 3) of the segments with these orientations (S, 3, 3), the pelvis at the origin."""
    origins_m = np.zeros_like(skeleton.offsets_m)
    for segment, parent in enumerate(skeleton.parents):
        if parent >= 0:
            origins_m[segment] = origins_m[parent] + axes[parent] @ skeleton.offsets_m[segment]
    return origins_m


def _stretch(skeleton: Skeleton, before_m: Array, axes: Array) -> Array:
    """Factors (S, 3) along the axes of each segment that bring the next joints to where the person has them.

    The least squares solution over the joints below a segment; 1 along axes in which none of them lies.
    """
    factors = np.ones_like(before_m)
    for segment in range(len(before_m)):
        below = np.flatnonzero(skeleton.parents == segment)
        if not below.size:
            continue
        theirs = (before_m[below] - before_m[segment]) @ axes[segment]  # (B, 3)
        ours = skeleton.offsets_m[below]
        lengths = np.square(theirs).sum(axis=0)
        far = lengths > 0.1 * lengths.sum()
        factors[segment, far] = (theirs * ours).sum(axis=0)[far] / lengths[far]
    return np.clip(factors, *_STRETCH)
