"""A body model of SMPL's layout, made of simrecon's own shape space: y up, z forward, 24 joints."""

from __future__ import annotations

from typing import Any

import numpy as np

from simrecon.body import shape
from simrecon.body.skeleton import template
from simrecon.types import Array

PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]
OURS = {
    0: "pelvis", 1: "left_hip", 2: "right_hip", 3: "spine", 4: "left_knee", 5: "right_knee", 6: "chest",
    7: "left_ankle", 8: "right_ankle", 12: "neck", 15: "head", 16: "left_shoulder", 17: "right_shoulder",
    18: "left_elbow", 19: "right_elbow", 20: "left_wrist", 21: "right_wrist",
}  # fmt: skip
FURTHER = {
    9: "chest",
    10: "left_ankle",
    11: "right_ankle",
    13: "chest",
    14: "chest",
    22: "left_wrist",
    23: "right_wrist",
}
TO_FILE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Our axes (x forward, y left, z up) to the file's (x left, y up, z forward)."""


def arrays(offset_m: float = 0.2) -> dict[str, Any]:
    """The file's arrays; the whole body is shifted by `offset_m`, as published files are."""
    own = shape.space()
    names = template().names
    skin = np.concatenate((own.vertices_mean_m[None], own.vertices_basis_m))  # (11, V, 3)
    centres = np.concatenate((own.points_mean_m[None], own.points_basis_m))
    centres = centres[:, [own.point_names.index(name) for name in names]]  # (11, 17, 3)
    rows = regressor(skin, centres)
    weights, joints = np.zeros((len(skin[0]), 24)), np.zeros((24, len(skin[0])))
    for joint, name in (OURS | FURTHER).items():
        s = names.index(name)
        joints[joint] = rows[s]
        weights[:, joint] = own.weights[:, s] / sum(other == name for other in (OURS | FURTHER).values())
    return {
        "v_template": skin[0] @ TO_FILE.T + offset_m,
        "shapedirs": np.moveaxis(skin[1:] @ TO_FILE.T, 0, 2),
        "J_regressor": joints,
        "weights": weights,
        "f": own.faces.astype(np.uint32),
        "kintree_table": np.array([[2**32 - 1, *PARENTS[1:]], range(24)], dtype=np.int64),
    }


def regressor(skin: Array, joints: Array) -> Array:
    """The smallest weights (17, V), rows summing to 1, that give these joints of these skins."""
    equations = np.concatenate(
        (np.moveaxis(skin, 1, 2).reshape(-1, skin.shape[1]), np.ones((1, skin.shape[1])))
    )
    right = np.concatenate(
        (np.moveaxis(joints, 1, 2).reshape(-1, joints.shape[1]), np.ones((1, joints.shape[1])))
    )
    return np.asarray(np.linalg.lstsq(equations, right, rcond=None)[0].T, float)
