"""A body model of SMPL's layout, made of simrecon's own shape space: y up, z forward, 24 or 55 joints."""

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
BETWEEN: dict[int, dict[str, float]] = {
    9: {"chest": 0.7, "neck": 0.3},
    13: {"chest": 0.5, "neck": 0.3, "left_shoulder": 0.2},
    14: {"chest": 0.5, "neck": 0.3, "right_shoulder": 0.2},
    22: {"left_wrist": 1.3, "left_elbow": -0.3},
    23: {"right_wrist": 1.3, "right_elbow": -0.3},
}
"""Where joints of a T-pose lie that ours lack: shares of joints that we have."""
SMPLX_PARENTS = [*PARENTS[:22], 15, 15, 15, *(20 for _ in range(15)), *(21 for _ in range(15))]
TO_FILE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Our axes (x forward, y left, z up) to the file's (x left, y up, z forward)."""


def arrays(offset_m: float = 0.2) -> dict[str, Any]:
    """The file's arrays in a relaxed stance; the body is shifted by `offset_m`, as published ones are."""
    skin, centres = _own()
    return _file(skin, regressor(skin, centres), offset_m)


def t_pose(offset_m: float = 0.2) -> dict[str, Any]:
    """The arrays in a T-pose, with joints of their own in chest, clavicles and hands, as SMPL's are."""
    skin, centres = _own()
    skin, centres = _raised(skin, centres)
    names = template().names
    rows = regressor(skin, centres)
    made = _file(skin, rows, offset_m)
    for joint, shares in BETWEEN.items():
        made["J_regressor"][joint] = sum(share * rows[names.index(name)] for name, share in shares.items())
    return made


def with_fingers(made: dict[str, Any]) -> dict[str, Any]:
    """The arrays with SMPL-X's 55 joints; jaw, eyes and fingers lie where their parents do."""
    rows, weights = made["J_regressor"], np.zeros((len(made["v_template"]), 55))
    weights[:, :22] = made["weights"][:, :22]
    weights[:, 20:22] += made["weights"][:, 22:]
    joints = np.concatenate((rows[:22], rows[SMPLX_PARENTS[22:]]))
    table = np.array([[2**32 - 1, *SMPLX_PARENTS[1:]], range(55)], dtype=np.int64)
    return made | {"J_regressor": joints, "weights": weights, "kintree_table": table}


def posed(made: dict[str, Any], betas: Array, turns: Array, trans_m: Array) -> tuple[Array, Array]:
    """The file's mesh and joints in a pose, by linear blend skinning as the family's papers state it.

    Args:
        made: the file's arrays.
        betas: (B,).
        turns: (K, 3, 3) of the joints in their parents.
        trans_m: (3,).

    Returns:
        Vertices (V, 3) and joints (K, 3).
    """
    rest = made["v_template"] + made["shapedirs"][:, :, : len(betas)] @ betas
    joints = made["J_regressor"] @ rest
    parents = made["kintree_table"][0]
    world, places = [turns[0]], [joints[0]]
    for joint in range(1, len(joints)):
        parent = parents[joint]
        world.append(world[parent] @ turns[joint])
        places.append(places[parent] + world[parent] @ (joints[joint] - joints[parent]))
    moved = [
        rest @ turn.T + (place - turn @ joint)
        for turn, place, joint in zip(world, places, joints, strict=True)
    ]
    mesh = np.einsum("vk,kvi->vi", made["weights"], np.array(moved))
    return mesh + trans_m, np.array(places) + trans_m


def _own() -> tuple[Array, Array]:
    """Skin (11, V, 3) and joints (11, 17, 3) of simrecon's space: the mean, then the basis."""
    own = shape.space()
    skin = np.concatenate((own.vertices_mean_m[None], own.vertices_basis_m))
    centres = np.concatenate((own.points_mean_m[None], own.points_basis_m))
    return skin, centres[:, [own.point_names.index(name) for name in template().names]]


def _raised(skin: Array, centres: Array) -> tuple[Array, Array]:
    """Skin and joints with all segments turned to where the mean has them in a T-pose."""
    own = shape.space()
    turns = np.swapaxes(own.frames(np.zeros(own.size))[1], 1, 2)  # (17, 3, 3)
    placed = centres.copy()
    for segment, parent in enumerate(template().parents):
        if parent >= 0:
            step = centres[:, segment] - centres[:, parent]
            placed[:, segment] = placed[:, parent] + step @ turns[parent].T
    local = skin[:, None] - centres[:, :, None]  # (11, 17, V, 3)
    moved = np.einsum("sij,bsvj->bsvi", turns, local) + placed[:, :, None]
    return np.einsum("vs,bsvi->bvi", own.weights, moved), placed


def _file(skin: Array, rows: Array, offset_m: float) -> dict[str, Any]:
    """The arrays of skin (11, V, 3), with joints by rows (17, V), and those that we lack where ours are."""
    own, names = shape.space(), template().names
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
