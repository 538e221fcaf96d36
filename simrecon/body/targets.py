"""What primitives are fitted to: the skin of each segment, in the segment's own frame."""

from __future__ import annotations

from dataclasses import dataclass

from simrecon.body import pieces, sizes
from simrecon.body.pieces import Piece
from simrecon.body.shape import ShapeSpace
from simrecon.body.skeleton import template
from simrecon.types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Target:
    """One segment of a skin, in its own frame.

    Attributes:
        piece: its faces.
        vertices_m: (m, 3) of the piece.
        own_m: (n, 3) vertices that the primitives should be near; where folded, those with y ≥ 0.
        weights: (n,) shares of their area, sum 1.
        folded: whether the segment is symmetric in y and only its left half is looked at.
    """

    piece: Piece
    vertices_m: Array
    own_m: Array
    weights: Array
    folded: bool


def of_shape(shapes: ShapeSpace, betas: Array) -> dict[str, Target]:
    """The segments of the left side and the centre that primitives are fitted to, by name."""
    origins, axes = shapes.frames(betas)
    return of_skin(shapes.vertices_m(betas), shapes.faces, shapes.weights.argmax(axis=1), origins, axes)


def of_skin(
    skin_m: Array, faces: IntArray, labels: IntArray, origins_m: Array, axes: Array
) -> dict[str, Target]:
    """As `of_shape`, of any skin.

    Args:
        skin_m: (V, 3) vertices in the relaxed stance.
        faces: (F, 3).
        labels: (V,) segment of each vertex.
        origins_m: (17, 3) of the segments' frames.
        axes: (17, 3, 3) of the segments' frames.
    """
    area = pieces.vertex_areas(skin_m, faces)
    names = template().names
    goals = {}
    for segment, piece in pieces.cut(faces, labels).items():
        name = names[segment]
        if name not in sizes.layout().segments:
            continue
        local = (skin_m - origins_m[segment]) @ axes[segment]  # (V, 3)
        folded = not name.startswith("left_")
        own = piece.own[local[piece.own, 1] > -1e-6] if folded else piece.own
        weights = area[own] / area[own].sum()
        goals[name] = Target(piece, piece.vertices(local), local[own], weights, folded)
    return goals
