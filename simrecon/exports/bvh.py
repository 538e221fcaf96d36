"""BVH: y up, centimetres, the skeleton in T-pose that faces z.

Rotations are about z, x, y, in this order. A BVH joint turns G = G_parent R about x = x_parent +
G_parent offset, as our segments do with R = rest q.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simrecon.evidence.mocap import names
from simrecon.exports.clock import TO_Y_UP, uniform_motion
from simrecon.geometry import rotations
from simrecon.results import Result
from simrecon.types import Array, Body, Skeleton

LOCAL = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Axes of a segment, x forward and z up, to those of a joint of the file, z forward and y up."""
CM = 100.0
# Where a chain ends: the landmark that its last bone leads to.
ENDS = {"head": "nose", "left_wrist": "left_index", "right_wrist": "right_index"}


def write(result: Result) -> bytes:
    """The simulated motion of a result as BVH, at a uniform frame rate."""
    times_s, qpos = uniform_motion(result)
    return bvh(result.body, qpos, float(times_s[1] - times_s[0]))


def bvh(body: Body, qpos: Array, interval_s: float) -> bytes:
    """A motion as BVH.

    Args:
        body: whose motion.
        qpos: (T, nq) configurations.
        interval_s: between frames.
    """
    skeleton = body.skeleton
    quats = qpos[:, 3:].reshape(len(qpos), -1, 4)  # (T, 17, 4)
    local = LOCAL @ rotations.matrix(rotations.multiply(skeleton.rest, quats)) @ LOCAL.T
    local[:, 0] = TO_Y_UP @ rotations.matrix(quats[:, 0]) @ LOCAL.T
    angles = np.degrees(euler_zxy(local))  # (T, 17, 3)
    columns = [CM * qpos[:, :3] @ TO_Y_UP.T]
    for segment, name in enumerate(skeleton.names):
        columns.append(angles[:, segment])
        if name.endswith("_ankle"):  # toes don't turn
            columns.append(np.zeros((len(qpos), 3)))
    rows = [" ".join(f"{value:.6f}" for value in row) for row in np.concatenate(columns, axis=1)]
    head = ["HIERARCHY", *_joint(skeleton, 0, "")]
    motion = ["MOTION", f"Frames: {len(qpos)}", f"Frame Time: {interval_s:.9f}"]
    return "\n".join([*head, *motion, *rows, ""]).encode("ascii")


def euler_zxy(matrices: Array) -> Array:
    """Angles a, b, c (T, J, 3), rad, of R = R_z(a) R_x(b) R_y(c), (T, J, 3, 3), without jumps over time."""
    b = np.arcsin(np.clip(matrices[..., 2, 1], -1.0, 1.0))
    a = np.arctan2(-matrices[..., 0, 1], matrices[..., 1, 1])
    c = np.arctan2(-matrices[..., 2, 0], matrices[..., 2, 2])
    return np.unwrap(np.stack((a, b, c), axis=-1), axis=0)


def _joint(skeleton: Skeleton, segment: int, indent: str) -> Iterator[str]:
    """Lines of a segment and of all below it, depth first, as the skeleton is ordered."""
    name, below = skeleton.names[segment], indent + "\t"
    root = segment == 0
    places = "6 Xposition Yposition Zposition" if root else "3"
    yield f"{indent}{'ROOT' if root else 'JOINT'} {_named(name)}"
    yield f"{indent}{{"
    yield below + _offset(skeleton.offsets_m[segment])
    yield f"{below}CHANNELS {places} Zrotation Xrotation Yrotation"
    for child in np.flatnonzero(skeleton.parents == segment).tolist():
        yield from _joint(skeleton, child, below)
    if name.endswith("_ankle"):
        ball, toe = (name.replace("ankle", point) for point in ("mtp", "toe"))
        yield f"{below}JOINT {_named(ball)}"
        yield f"{below}{{"
        yield f"{below}\t{_offset(_point(skeleton, ball))}"
        yield f"{below}\tCHANNELS 3 Zrotation Xrotation Yrotation"
        yield from _end(_point(skeleton, toe) - _point(skeleton, ball), below + "\t")
        yield f"{below}}}"
    elif name in ENDS:
        yield from _end(_point(skeleton, ENDS[name]), below)
    yield f"{indent}}}"


def _end(offset_m: Array, indent: str) -> Iterator[str]:
    yield from (f"{indent}End Site", f"{indent}{{", f"{indent}\t{_offset(offset_m)}", f"{indent}}}")


def _offset(offset_m: Array) -> str:
    return "OFFSET " + " ".join(f"{value:.6f}" for value in CM * LOCAL @ offset_m)


def _point(skeleton: Skeleton, name: str) -> Array:
    offset: Array = skeleton.point_offsets_m[skeleton.point_names.index(name)]
    return offset


def _named(name: str) -> str:
    """What a segment is called in the file."""
    left: str = names.table("bvh")[name.replace("right_", "left_", 1)]
    return left.replace("Left", "Right", 1) if name.startswith("right_") else left
