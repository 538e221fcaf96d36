"""Body models that the user owns (SMPL, SMPL-H, SMPL-X, GHUM and others of their layout) as a `ShapeSpace`.

Keys, and further names under which they are read:

- v_template (V, 3): template, vertices_template
- shapedirs (V, 3, B): shape_basis
- J_regressor (K, V): joint_regressor
- weights (V, K): lbs_weights, skinning_weights
- f (F, 3): faces
- kintree_table (2, K): parents (K,)
- joint_names (K,): needed unless K is that of SMPL (24), SMPL-H (52) or SMPL-X (55)
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon.body import foreign, model_arrays, model_joints, model_landmarks, shape
from simrecon.body.shape import HEAD_POINT, FileJoints, ShapeSpace
from simrecon.body.skeleton import template
from simrecon.errors import InputError
from simrecon.io.limits import MISFITS
from simrecon.types import Array

BETAS_MAX = 10
"""Shape parameters used of a file: files of SMPL-X keep expression after shape in the same array."""
STATURE_RANGE_M = (0.5, 2.8)


def read(path: Path | str) -> ShapeSpace:
    """Read a body model; landmarks are placed as on simrecon's own mean shape.

    Args:
        path: `.npz` or `.pkl`.

    Raises:
        InputError: it can't be read, lacks a key, or its arrays or joints don't fit together.
    """
    data = foreign.load(path)
    try:
        with np.errstate(all="ignore"):  # what comes of absurd numbers is refused by the checks
            return _space(data, path)
    except MISFITS as error:
        reason = f"{type(error).__name__}: {error}"[:200]
        raise InputError(f"{path}: found arrays that do not fit ({reason}); valid: a body model") from error


def _space(data: dict[str, Any], path: Path | str) -> ShapeSpace:
    """The shape space of a file's arrays."""
    arrays = {key: model_arrays.array(data, key, path) for key in model_arrays.KEYS}
    template_m, basis = arrays["v_template"], arrays["shapedirs"]
    model_arrays.check(arrays, path)
    regressor, faces = arrays["J_regressor"], arrays["f"].astype(np.int64)
    parents = model_arrays.parents_of(data, len(regressor), path)
    named = model_joints.names(data, len(regressor), path)
    owner, joints = model_joints.segments(named, parents, path)
    weights = _weights(arrays["weights"], owner, path)
    used = min(basis.shape[2], BETAS_MAX)
    axes = _axes(regressor @ template_m, joints, path)
    mean = template_m @ axes.T
    basis = np.moveaxis(basis[:, :, :used], 2, 0)  # (B, V, 3)
    directions = basis @ axes.T
    rows = regressor[[joints[name] for name in template().names]]  # (17, V)
    hips = 0.5 * (rows[template().names.index("left_hip")] + rows[template().names.index("right_hip")])
    mean, directions = mean - hips @ mean, directions - np.einsum("v,bvi->bi", hips, directions)[:, None]
    names, maps = model_landmarks.place(mean, rows, weights)
    space = ShapeSpace(
        Path(path).name,
        names,
        maps @ mean,
        np.einsum("mv,bvi->bmi", maps, directions),
        mean,
        directions,
        faces,
        weights,
        1.0,
        FileJoints(named, regressor @ template_m, regressor @ basis, axes),
    )
    return _checked(_with_head_point(space), path)


def _weights(by_joint: Array, owner: list[int], path: Path | str) -> Array:
    """Skinning weights (V, 17) by our segments, of those (V, K) by the file's joints."""
    names = template().names
    empty = sorted(set(range(len(names))) - set(np.array(owner)[by_joint.argmax(axis=1)].tolist()))
    if empty:
        raise InputError(f"{path}: weights: no vertex belongs to {names[empty[0]]!r}; valid: some of each")
    weights = np.zeros((len(by_joint), len(names)))
    for joint, segment in enumerate(owner):
        weights[:, segment] += by_joint[:, joint]
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
    return weights


def _axes(centres_m: Array, joints: dict[str, int], path: Path | str) -> Array:
    """Rotation (3, 3) from the file's axes to ours, to the nearest axes."""
    left = centres_m[joints["left_hip"]] - centres_m[joints["right_hip"]]
    up = centres_m[joints["head"]] - centres_m[joints["pelvis"]]
    y, z = (np.eye(3)[np.argmax(np.abs(v))] * np.sign(v[np.argmax(np.abs(v))]) for v in (left, up))
    if abs(float(y @ z)) > 0.5:
        raise InputError(
            f"{path}: the head of the body is beside its hips; valid: a body that stands upright"
        )
    return np.stack((np.cross(y, z), y, z))


def _with_head_point(space: ShapeSpace) -> ShapeSpace:
    """The space with the point `head`, as far before the head's joint as on simrecon's mean shape."""
    own = shape.space()
    points = own.points_m(np.zeros(own.size))
    at = space.point_names.index("head")
    placed = space.points_mean_m[at] + points[HEAD_POINT] - points["head"]
    return replace(
        space,
        point_names=(*space.point_names, HEAD_POINT),
        points_mean_m=np.vstack((space.points_mean_m, placed)),
        points_basis_m=np.concatenate((space.points_basis_m, space.points_basis_m[:, at : at + 1]), axis=1),
    )


def _checked(space: ShapeSpace, path: Path | str) -> ShapeSpace:
    low, high = STATURE_RANGE_M
    height = shape.stature_m(np.zeros(space.size), space)
    if not low < height < high:
        raise InputError(
            f"{path}: v_template: the body is {height:.3g} m tall; valid: from {low} to {high} m"
        )
    if space.volume_m3(np.zeros(space.size)) <= 0:
        raise InputError(f"{path}: f: the faces look inwards; valid: counter-clockwise from outside")
    return space
