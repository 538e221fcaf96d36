"""BVH: y up, centimetres, the skeleton in T-pose that faces z.

Rotations are about z, x, y, in this order. A BVH joint turns G = G_parent R about x = x_parent +
G_parent offset, as our segments do with R = rest q.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simrecon.exports import rigs
from simrecon.exports.axes import LOCAL, TO_Y_UP
from simrecon.exports.rigs import Joint
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.types import Array, Body

CM = 100.0
DIGITS = 6


def write(view: ResultView) -> dict[str, bytes]:
    """The motion as BVH, with the joint names of the rig."""
    return {"motion.bvh": bvh(view.body, view.qpos, view.interval_s, view.choices.rig)}


def bvh(body: Body, qpos: Array, interval_s: float, rig: str = "simrecon") -> bytes:
    """A motion as BVH.

    Args:
        body: whose motion.
        qpos: (T, nq) configurations.
        interval_s: between frames.
        rig: whose joint names.
    """
    joints = rigs.joints(body.skeleton, rig)
    quats = qpos[:, 3:].reshape(len(qpos), -1, 4)  # (T, 17, 4)
    local = LOCAL @ rotations.matrix(rotations.multiply(body.skeleton.rest, quats)) @ LOCAL.T
    local[:, 0] = TO_Y_UP @ rotations.matrix(quats[:, 0]) @ LOCAL.T
    angles = np.degrees(euler_zxy(local))  # (T, 17, 3)
    still = np.zeros((len(qpos), 3))
    columns = [CM * qpos[:, :3] @ TO_Y_UP.T]
    columns += [angles[:, joint.segment] if joint.turns else still for joint in joints]
    form = " ".join([f"%.{DIGITS}f"] * (3 * len(columns)))
    rows = [form % tuple(row) for row in np.concatenate(columns, axis=1).tolist()]
    head = ["HIERARCHY", *_joint(joints, 0, "")]
    motion = ["MOTION", f"Frames: {len(qpos)}", f"Frame Time: {interval_s:.9f}"]
    return "\n".join([*head, *motion, *rows, ""]).encode("ascii")


def euler_zxy(matrices: Array) -> Array:
    """Angles a, b, c (T, J, 3), rad, of R = R_z(a) R_x(b) R_y(c), (T, J, 3, 3), without jumps over time."""
    b = np.arcsin(np.clip(matrices[..., 2, 1], -1.0, 1.0))
    a = np.arctan2(-matrices[..., 0, 1], matrices[..., 1, 1])
    c = np.arctan2(-matrices[..., 2, 0], matrices[..., 2, 2])
    return np.unwrap(np.stack((a, b, c), axis=-1), axis=0)


def _joint(joints: tuple[Joint, ...], row: int, indent: str) -> Iterator[str]:
    """Lines of a joint and of all below it."""
    joint, below = joints[row], indent + "\t"
    root = joint.parent < 0
    places = "6 Xposition Yposition Zposition" if root else "3"
    yield f"{indent}{'ROOT' if root else 'JOINT'} {joint.name}"
    yield f"{indent}{{"
    yield below + _offset(joint.offset_m)
    yield f"{below}CHANNELS {places} Zrotation Xrotation Yrotation"
    for child, other in enumerate(joints):
        if other.parent == row:
            yield from _joint(joints, child, below)
    if joint.end_m is not None:
        yield from (f"{below}End Site", f"{below}{{", f"{below}\t{_offset(joint.end_m)}", f"{below}}}")
    yield f"{indent}}}"


def _offset(offset_m: Array) -> str:
    return "OFFSET " + " ".join(f"{value:.{DIGITS}f}" for value in CM * LOCAL @ offset_m)
