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

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from simrecon.body import foreign, shape
from simrecon.body.frames import segment_frames
from simrecon.body.shape import HEAD_POINT, ShapeSpace
from simrecon.body.skeleton import template
from simrecon.errors import InputError
from simrecon.types import Array, IntArray

BETAS_MAX = 10
"""Shape parameters used of a file: files of SMPL-X keep expression after shape in the same array."""
SOLE_VERTICES = 0.02
"""Share of a foot's vertices whose mean is the sole: the lowest ones."""
NEAR_VERTICES = 12
"""Whose weighted mean a landmark is."""
STATURE_RANGE_M = (0.5, 2.8)
_KEYS = {
    "v_template": ("template", "vertices_template"),
    "shapedirs": ("shape_basis",),
    "J_regressor": ("joint_regressor",),
    "weights": ("lbs_weights", "skinning_weights"),
    "f": ("faces",),
}
# Joints in the order of the SMPL family; those that follow belong to hands, jaw and eyes.
_SMPL = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
_COUNTS = {24: "SMPL", 52: "SMPL-H", 55: "SMPL-X"}
# Our segments by other names, in lower case without "_", " " and "-"; the first one that a file has.
_ALIASES = {
    "pelvis": ("pelvis", "hips", "root"),
    "spine": ("spine1", "spine", "spinelower"),
    "chest": ("spine2", "chest", "spinemiddle"),
    "neck": ("neck", "neck1"),
    "head": ("head",),
    "hip": ("hip", "upleg", "upperleg", "thigh"),
    "knee": ("knee", "leg", "lowerleg", "calf"),
    "ankle": ("ankle", "foot"),
    "shoulder": ("upperarm", "arm", "shoulder"),
    "elbow": ("elbow", "forearm", "lowerarm"),
    "wrist": ("wrist", "hand"),
}


def read(path: Path | str) -> ShapeSpace:
    """Read a body model; landmarks are placed in head, hand and foot as on simrecon's own mean shape.

    Args:
        path: `.npz` or `.pkl`.

    Raises:
        InputError: it can't be read, lacks a key, or its arrays or joints don't fit together.
    """
    data = foreign.load(path)
    arrays = {key: _array(data, key, path) for key in _KEYS}
    template_m, basis = arrays["v_template"], arrays["shapedirs"]
    count = len(template_m)
    _check(arrays, count, path)
    regressor, faces = arrays["J_regressor"], arrays["f"].astype(np.int64)
    parents = _parents(data, len(regressor), path)
    owner, joints = _segments(_names(data, len(regressor), path), parents, path)
    empty = sorted(
        set(range(len(template().names))) - set(np.array(owner)[arrays["weights"].argmax(axis=1)].tolist())
    )
    if empty:
        raise InputError(
            f"{path}: weights: found no vertex of {template().names[empty[0]]!r}; valid: some of each"
        )
    used = min(basis.shape[2], BETAS_MAX)
    axes = _axes(regressor @ template_m, joints, path)
    mean = template_m @ axes.T
    directions = np.moveaxis(basis[:, :, :used], 2, 0) @ axes.T  # (B, V, 3)
    rows = regressor[[joints[name] for name in template().names]]  # (17, V)
    hips = 0.5 * (rows[template().names.index("left_hip")] + rows[template().names.index("right_hip")])
    mean, directions = mean - hips @ mean, directions - np.einsum("v,bvi->bi", hips, directions)[:, None]
    weights = np.zeros((count, len(template().names)))
    for joint, segment in enumerate(owner):
        weights[:, segment] += arrays["weights"][:, joint]
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
    names, maps = _points(mean, rows, weights)
    made = ShapeSpace(
        Path(path).name,
        names,
        maps @ mean,
        np.einsum("mv,bvi->bmi", maps, directions),
        mean,
        directions,
        faces,
        weights,
        1.0,
    )
    return _checked(_with_head_point(made), path)


def _array(data: dict[str, Any], key: str, path: Path | str) -> Array:
    found = next((data[name] for name in (key, *_KEYS[key]) if data.get(name) is not None), None)
    try:
        array = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if found is None or not np.isfinite(array).all():
        what = "no such key" if found is None else "no finite numbers"
        raise InputError(f"{path}: {key}: found {what}; a body model needs {', '.join(_KEYS)}")
    return array


def _check(arrays: dict[str, Array], count: int, path: Path | str) -> None:
    joints = len(arrays["J_regressor"])
    valid = {
        "v_template": (count, 3),
        "shapedirs": (count, 3, arrays["shapedirs"].shape[-1]),
        "J_regressor": (joints, count),
        "weights": (count, joints),
        "f": (len(arrays["f"]), 3),
    }
    for key, wanted in valid.items():
        if arrays[key].shape != wanted or 0 in wanted:
            raise InputError(f"{path}: {key}: found an array of shape {arrays[key].shape}; valid: {wanted}")
    if arrays["f"].min() < 0 or arrays["f"].max() >= count:
        raise InputError(f"{path}: f: found a vertex {arrays['f'].max():g}; valid: from 0 to {count - 1}")


def _parents(data: dict[str, Any], joints: int, path: Path | str) -> IntArray:
    found = data.get("kintree_table", data.get("parents"))
    table = np.asarray([] if found is None else found)
    table = table[0] if table.ndim == 2 else table
    if table.shape != (joints,) or not np.issubdtype(table.dtype, np.number):
        raise InputError(
            f"{path}: kintree_table: found shape {table.shape}; valid: (2, {joints}), parents first"
        )
    parents = table.astype(np.int64)
    parents[0] = -1  # published as 2³² - 1
    if not np.all(parents[1:] < np.arange(1, joints)) or (parents[1:] < 0).any():
        raise InputError(f"{path}: kintree_table: found a joint before its parent; valid: parents first")
    return np.asarray(parents)


def _names(data: dict[str, Any], joints: int, path: Path | str) -> tuple[str, ...]:
    given = data.get("joint_names")
    if given is not None and len(given) == joints:
        return tuple(str(name) for name in given)
    if joints not in _COUNTS:
        known = ", ".join(f"{count} ({name})" for count, name in _COUNTS.items())
        raise InputError(f"{path}: joint_names: not found for {joints} joints; without names valid: {known}")
    return _SMPL + tuple(f"further{i}" for i in range(joints - len(_SMPL)))


def _segments(
    names: tuple[str, ...], parents: IntArray, path: Path | str
) -> tuple[list[int], dict[str, int]]:
    """Segment of each joint, its own or that of the nearest ancestor that is ours; our joints' indices."""
    joints: dict[str, int] = {}
    plain = [name.lower().replace("_", "").replace(" ", "").replace("-", "") for name in names]
    for segment in template().names:
        side, _, stem = segment.rpartition("_")
        wanted = [
            name
            for alias in _ALIASES[stem]
            for name in dict.fromkeys((side + alias, alias + side, side[:1] + alias))
        ]
        hits = [name for name in wanted if name in plain]
        if not hits:
            raise InputError(f"{path}: joint_names: found none for {segment!r}; valid: {', '.join(wanted)}")
        joints[segment] = plain.index(hits[0])
    ours = {joint: template().names.index(segment) for segment, joint in joints.items()}
    owner = [0] * len(names)
    for i, parent in enumerate(parents):
        owner[i] = ours.get(i, owner[parent] if parent >= 0 else 0)
    return owner, joints


def _axes(centres_m: Array, joints: dict[str, int], path: Path | str) -> Array:
    """Rotation (3, 3) from the file's axes to ours, to the nearest axes."""
    left = centres_m[joints["left_hip"]] - centres_m[joints["right_hip"]]
    up = centres_m[joints["head"]] - centres_m[joints["pelvis"]]
    y, z = (np.eye(3)[np.argmax(np.abs(v))] * np.sign(v[np.argmax(np.abs(v))]) for v in (left, up))
    if abs(float(y @ z)) > 0.5:
        raise InputError(
            f"{path}: found a body whose head is beside its hips; valid: one that stands upright"
        )
    return np.stack((np.cross(y, z), y, z))


def _points(mean: Array, rows: Array, weights: Array) -> tuple[tuple[str, ...], Array]:
    """Names, and maps (M, V) from vertices to joint centres, landmarks, crown and soles."""
    own = shape.space()
    zero = np.zeros(own.size)
    names, labels = template().names, weights.argmax(axis=1)
    own_skin, own_points, own_labels = own.vertices_m(zero), own.points_m(zero), own.weights.argmax(axis=1)
    origins = rows @ mean
    at = _rough(dict(zip(names, origins, strict=True)))
    own_origins, own_axes = own.frames(zero)
    maps: dict[str, Array] = {}
    # Feet and hands first: they turn the frames in which their other points are placed.
    first = [f"{side}_{end}" for side in ("left", "right") for end in ("heel", "toe", "index", "pinky")]
    for name in (*(4 * first), *(name for name in own.point_names if name not in first)):
        axes = segment_frames(names, at)
        if name in names or name == HEAD_POINT:
            continue
        segment = names.index(_segment_of(name))
        here = np.flatnonzero(labels == segment)
        local = (mean[here] - origins[segment]) @ axes[segment]
        row = np.zeros(len(mean))
        if name.endswith("_sole"):
            row[here[np.argsort(local[:, 2])[: max(1, round(SOLE_VERTICES * len(here)))]]] = 1.0
        else:
            theirs = (own_skin[own_labels == segment] - own_origins[segment]) @ own_axes[segment]
            low, size = theirs.min(axis=0), np.ptp(theirs, axis=0)
            share = ((own_points[name] - own_origins[segment]) @ own_axes[segment] - low) / size
            target = local.min(axis=0) + share * np.ptp(local, axis=0)
            near = here[cKDTree(local).query(target, k=min(NEAR_VERTICES, len(here)))[1]]
            row[near] = _weights(mean[near], origins[segment] + axes[segment] @ target)
        maps[name] = row / row.sum()
        at[name] = maps[name] @ mean
    return (*names, *maps), np.stack((*rows, *maps.values()))


def _weights(corners_m: Array, target_m: Array) -> Array:
    """The smallest weights (n,) of points (n, 3), sum 1, whose mean is the target, or as near as can be."""
    centre = corners_m.mean(axis=0)
    moved: Array = np.linalg.pinv(corners_m - centre).T @ (target_m - centre)
    return np.asarray(moved - moved.mean() + 1.0 / len(corners_m))


def _rough(at_m: dict[str, Array]) -> dict[str, Array]:
    """Joint centres with feet that point forward."""
    for side in ("left", "right"):
        at_m[f"{side}_heel"], at_m[f"{side}_toe"] = np.zeros(3), np.array([1.0, 0.0, 0.0])
    return at_m


def _segment_of(point: str) -> str:
    unit = template()
    if point in unit.point_names:
        return str(unit.names[unit.point_segments[unit.point_names.index(point)]])
    return "head" if point == "crown" else point.replace("_sole", "_ankle")


def _with_head_point(made: ShapeSpace) -> ShapeSpace:
    """Adds the point `head` at a fixed place before the head's joint, as far as on simrecon's mean shape."""
    own = shape.space()
    points = own.points_m(np.zeros(own.size))
    at = made.point_names.index("head")
    return ShapeSpace(
        made.name,
        (*made.point_names, HEAD_POINT),
        np.vstack((made.points_mean_m, made.points_mean_m[at] + points[HEAD_POINT] - points["head"])),
        np.concatenate((made.points_basis_m, made.points_basis_m[:, at : at + 1]), axis=1),
        made.vertices_mean_m,
        made.vertices_basis_m,
        made.faces,
        made.weights,
        made.volume_factor,
    )


def _checked(made: ShapeSpace, path: Path | str) -> ShapeSpace:
    low, high = STATURE_RANGE_M
    found = shape.stature_m(np.zeros(made.size), made)
    if not low < found < high:
        raise InputError(
            f"{path}: v_template: found a body {found:.3g} m tall; valid: from {low} to {high} m"
        )
    if made.volume_m3(np.zeros(made.size)) <= 0:
        raise InputError(f"{path}: f: found faces that look inwards; valid: counter-clockwise from outside")
    return made
