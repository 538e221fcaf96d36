"""Arrays of a body model's file: names of their keys, and whether they fit together."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from simrecon.errors import InputError
from simrecon.types import Array, IntArray

KEYS = {
    "v_template": ("template", "vertices_template"),
    "shapedirs": ("shape_basis",),
    "J_regressor": ("joint_regressor",),
    "weights": ("lbs_weights", "skinning_weights"),
    "f": ("faces",),
}
"""Keys, and further names under which they are read."""


def array(data: dict[str, Any], key: str, path: Path | str) -> Array:
    """The numbers of a key, read under any of its names.

    Args:
        data: content of the file.
        key: of `KEYS`.
        path: named in errors.

    Raises:
        InputError: the file lacks the key, or it doesn't hold finite numbers.
    """
    value = next((data[name] for name in (key, *KEYS[key]) if data.get(name) is not None), None)
    try:
        found = np.asarray(value)
        numbers = found.astype(np.float64) if found.dtype.kind != "c" else np.array(np.nan)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)
    if value is None or not np.isfinite(numbers).all():
        what = "no such key" if value is None else "no finite numbers"
        raise InputError(f"{path}: {key}: found {what}; a body model needs {', '.join(KEYS)}")
    return numbers


def check(arrays: dict[str, Array], path: Path | str) -> None:
    """Check that the arrays of `KEYS` fit together.

    Raises:
        InputError: a shape differs, or a face has a vertex that isn't there.
    """
    count = len(arrays["v_template"])
    joints = len(arrays["J_regressor"])
    valid = {
        "v_template": (count, 3),
        "shapedirs": (count, 3, arrays["shapedirs"].shape[-1]),
        "J_regressor": (joints, count),
        "weights": (count, joints),
        "f": (len(arrays["f"]), 3),
    }
    for key, expected in valid.items():
        shape = arrays[key].shape
        if shape != expected or 0 in expected:
            raise InputError(f"{path}: {key}: found an array of shape {shape}; valid: {expected}")
    low, high = arrays["f"].min(), arrays["f"].max()
    if low < 0 or high >= count:
        raise InputError(f"{path}: f: found {low:g} to {high:g}; valid: from 0 to {count - 1}")


def parents_of(data: dict[str, Any], joints: int, path: Path | str) -> IntArray:
    """Parent of each joint (K,), -1 for the first.

    Raises:
        InputError: the file has none, or not one before each joint.
    """
    value = data.get("kintree_table", data.get("parents"))
    table = np.asarray([] if value is None else value)
    table = table[0] if table.ndim == 2 else table
    if table.shape != (joints,) or table.dtype.kind not in "iuf":
        raise InputError(
            f"{path}: kintree_table: found shape {table.shape}; valid: (2, {joints}), parents first"
        )
    parents = table.astype(np.int64)
    parents[0] = -1  # published as 2³² - 1
    if not np.all(parents[1:] < np.arange(1, joints)) or (parents[1:] < 0).any():
        raise InputError(f"{path}: kintree_table: a joint comes before its parent; valid: parents first")
    return np.asarray(parents)
