"""The shape space: shape parameters (betas) → joint centres, landmarks and skin of a relaxed stance.

    x(β) = x̄ + Σ_i β_i B_i

for joint centres, landmarks and skin vertices alike; β has independent components of unit variance over the
sampled adults from which the basis was computed. Axes: x forward, y left, z up; the origin lies midway
between the hip joints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from simrecon import resources
from simrecon.body.frames import segment_frames
from simrecon.body.skeleton import t_pose_m, template
from simrecon.errors import InputError, SimreconError
from simrecon.types import Array, IntArray, Skeleton

SCHEMA = "simrecon.shape/1"
BETA_MAX = 5.0
"""Shape parameters beyond that many standard deviations are refused."""
HEAD_POINT = "face"
"""How the shape file names the point `head` of models/body/landmarks.toml; `head` is the joint there."""
POINTS = {"head": HEAD_POINT, "skull_base": "head", "head_top": "crown"}
"""How the shape file names points that have another name in models/body/landmarks.toml."""


@dataclass(frozen=True, eq=False)
class FileJoints:
    """Joint centres of a body model's file in its rest pose, linear in β as all points; K joints.

    Attributes:
        names: K names.
        mean_m, basis_m: (K, 3), (B, K, 3), in the file's own axes, from its own origin.
        axes: (3, 3) rotation from the file's axes to ours.
    """

    names: tuple[str, ...]
    mean_m: Array
    basis_m: Array
    axes: Array

    def places_m(self, betas: Array) -> Array:
        """Joint centres (K, 3) of betas (B,)."""
        return np.asarray(self.mean_m + np.tensordot(betas, self.basis_m, axes=1))


@dataclass(frozen=True, eq=False)
class ShapeSpace:
    """A linear space of body shapes. B shape parameters, M points, V skin vertices, F faces, 17 segments.

    Attributes:
        name: `simrecon`, or the file name of a body model; for messages and reports.
        point_names: M names: the segments' joint centres, landmarks, `crown`, `left_sole`, `right_sole`.
        points_mean_m, points_basis_m: (M, 3), (B, M, 3).
        vertices_mean_m, vertices_basis_m: (V, 3), (B, V, 3).
        faces: (F, 3) triangles, counter-clockwise seen from outside.
        weights: (V, 17) skinning weights by segment of the skeleton, rows sum to 1.
        volume_factor: of the body over that of this skin.
        joints: all joints of the file that it was read from; None for simrecon's own.
    """

    name: str
    point_names: tuple[str, ...]
    points_mean_m: Array
    points_basis_m: Array
    vertices_mean_m: Array
    vertices_basis_m: Array
    faces: IntArray
    weights: Array
    volume_factor: float
    joints: FileJoints | None = None

    @property
    def size(self) -> int:
        """Number of shape parameters."""
        return len(self.points_basis_m)

    def points_m(self, betas: Array) -> dict[str, Array]:
        """Points (..., 3) by name, of betas (..., B)."""
        placed = self.points_mean_m + np.tensordot(betas, self.points_basis_m, axes=1)  # (..., M, 3)
        return {name: placed[..., i, :] for i, name in enumerate(self.point_names)}

    def vertices_m(self, betas: Array) -> Array:
        """Skin (..., V, 3) in the relaxed stance, of betas (..., B)."""
        return np.asarray(self.vertices_mean_m + np.tensordot(betas, self.vertices_basis_m, axes=1))

    def frames(self, betas: Array) -> tuple[Array, Array]:
        """Origins (..., 17, 3) and orientations (..., 17, 3, 3) of the segments in the relaxed stance."""
        points = self.points_m(betas)
        names = template().names
        return np.stack([points[name] for name in names], axis=-2), segment_frames(names, points)

    def volume_m3(self, betas: Array) -> float:
        """Volume of the body, betas (B,): the divergence theorem over the skin's faces."""
        a, b, c = np.moveaxis(self.vertices_m(betas)[self.faces], 1, 0)  # (F, 3) each
        return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0) * self.volume_factor


@cache
def space() -> ShapeSpace:
    """The shape space that ships with simrecon: ten parameters (`models/body/shape.npz`, models/README.md).

    Raises:
        SimreconError: the file is missing or damaged.
    """
    path = resources.folder("models") / "body" / "shape.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            arrays = {key: data[key] for key in data.files}
        if str(arrays["schema"]) != SCHEMA:
            raise ValueError(f"schema is {arrays['schema']}")
        weights = np.zeros((len(arrays["weights"]), len(template().names)))
        np.put_along_axis(weights, arrays["weight_segments"].astype(np.int64), arrays["weights"], axis=1)
        return ShapeSpace(
            "simrecon",
            tuple(str(name) for name in arrays["point_names"]),
            arrays["points_mean_m"].astype(np.float64),
            arrays["points_basis_m"].astype(np.float64),
            arrays["vertices_mean_m"].astype(np.float64),
            arrays["vertices_basis_m"].astype(np.float64),
            arrays["faces"].astype(np.int64),
            weights,
            float(arrays["volume_factor"]),
        )
    except (OSError, ValueError, KeyError) as error:
        raise SimreconError(f"cannot read {path}: {error}; install simrecon again") from error


def check(betas: Array, shapes: ShapeSpace, where: str = "betas") -> Array:
    """All shape parameters, zero where the user states none.

    Args:
        betas: (up to B,).
        shapes: whose parameters they are.
        where: named in errors.

    Raises:
        InputError: too many of them, or not finite, or beyond `BETA_MAX`.
    """
    values = np.asarray(betas, dtype=np.float64)
    if values.ndim != 1 or len(values) > shapes.size:
        raise InputError(
            f"{where}: found an array of shape {values.shape}; "
            f"valid: up to {shapes.size} numbers (shape space {shapes.name})"
        )
    if not np.all(np.abs(values) <= BETA_MAX):
        raise InputError(
            f"{where}: found {values.tolist()}; valid: numbers from -{BETA_MAX:g} to {BETA_MAX:g}"
        )
    return np.concatenate((values, np.zeros(shapes.size - len(values))))


def skeleton(betas: Array, shapes: ShapeSpace | None = None) -> Skeleton:
    """The kinematic tree of a shape, lengths in m.

    Args:
        betas: (B,).
        shapes: the shape space; that of simrecon if None.
    """
    shapes = shapes or space()
    unit = template()
    points = shapes.points_m(betas)
    origins, axes = shapes.frames(betas)
    offsets = np.zeros_like(unit.offsets_m)
    for i, parent in enumerate(unit.parents):
        if parent >= 0:
            offsets[i] = axes[parent].T @ (origins[i] - origins[parent])
    local = np.zeros_like(unit.point_offsets_m)
    for row, (name, segment) in enumerate(zip(unit.point_names, unit.point_segments, strict=True)):
        point = POINTS.get(name, name)
        if point in points and (name == "head" or name not in unit.names):
            local[row] = axes[segment].T @ (points[point] - origins[segment])
    for side in ("left", "right"):
        heel, toe, mtp = (unit.point_names.index(f"{side}_{end}") for end in ("heel", "toe", "mtp"))
        local[mtp] = _along(local[[heel, toe]], unit.point_offsets_m[[heel, toe, mtp]])
    return replace(unit, offsets_m=offsets, point_offsets_m=local)


def _along(ends_m: Array, usual_m: Array) -> Array:
    """The joint of the big toe (3,) between heel and toe (2, 3), as the template has the three (3, 3)."""
    sole, usual = ends_m[1] - ends_m[0], usual_m[1] - usual_m[0]
    share = float((usual_m[2] - usual_m[0]) @ usual / (usual @ usual))
    above = (usual_m[2] - usual_m[0] - share * usual) * np.linalg.norm(sole) / np.linalg.norm(usual)
    return np.asarray(ends_m[0] + share * sole + above)


def stature_m(betas: Array, shapes: ShapeSpace | None = None, tree: Skeleton | None = None) -> float:
    """Height of a shape that stands upright, legs straight: from the soles to the crown.

    Args:
        betas: (B,).
        shapes: the shape space; that of simrecon if None.
        tree: `skeleton` of the shape, if it is known.
    """
    shapes = shapes or space()
    tree, points = tree or skeleton(betas, shapes), shapes.points_m(betas)
    upright = t_pose_m(tree)
    top = upright[tree.names.index("head"), 2] + (points["crown"] - points["head"])[2]
    ankle = upright[tree.names.index("left_ankle"), 2]
    return float(top - ankle - (points["left_sole"] - points["left_ankle"])[2])
