"""HumanML3D, `.npy` at 20 Hz, y up, m: vectors of 263 numbers (`new_joint_vecs`), or 22 joints.

A vector holds the root's turn about y since the frame before (half the angle), its steps along x and z on its
own axes, its height, the other 21 joints on its axes, then rotations, velocities and contacts, of which the
joints need nothing (`recover_from_ric` of HumanML3D, Guo et al. 2022). The joints are SMPL's first 22, put on
one skeleton.
"""

from __future__ import annotations

import numpy as np

from simrecon.evidence.axes import to_z_up
from simrecon.evidence.content import Content
from simrecon.evidence.options import Options, times_s
from simrecon.evidence.smpl import motion as smpl
from simrecon.evidence.values import bounded
from simrecon.geometry import rotations
from simrecon.types import Array, Evidence

RATE_HZ = 20.0
JOINTS, WIDTH = 22, 263
STRETCH_MAX = 0.05
"""So much of its length a thigh or shank varies at most; those of vectors that were normalised do by more."""


def matches(content: Content) -> bool:
    """An array of HumanML3D."""
    tree = content.tree if content.kind == "npy" else None
    if not isinstance(tree, np.ndarray) or tree.dtype.kind != "f" or not len(tree.shape) or not len(tree):
        return False
    return tree.shape[1:] in ((WIDTH,), (JOINTS, 3))


def read(content: Content, options: Options) -> Evidence:
    """Evidence of a motion."""
    values = bounded(content, "array", content.tree.astype(float))
    if np.isnan(values).any():
        raise content.fail("array", f"{int(np.isnan(values).sum())} numbers that are none", "finite numbers")
    vectors = values.ndim == 2
    joints = recovered(values) if vectors else values
    names = smpl.names()[:JOINTS]
    _check_lengths(content, joints, names)
    axis, how = ("y", "this format's convention") if options.up is None else (options.up, "as given")
    rate = options.fps or RATE_HZ
    kind = f"vectors of {WIDTH} numbers" if vectors else f"{JOINTS} joints"
    unused = "; rotations, velocities and contacts are not used" if vectors else ""
    return Evidence(
        times_s=times_s(content.source, np.arange(len(joints)), rate),
        keypoint_names=(),
        keypoints_px=np.empty((len(joints), 0, 2)),
        scores=np.empty((len(joints), 0)),
        joint_names=names,
        joints_m=joints @ to_z_up(axis).T,
        joints_frame="world",
        trust="mocap",
        sha256=content.sha256,
        reading=f"{kind}, {rate:g} Hz, up {axis} ({how}); lengths of the data set's one skeleton{unused}",
    )


def recovered(vectors: Array) -> Array:
    """Joints (T, 22, 3), y up, of vectors (T, 263)."""
    turn = np.zeros((len(vectors), 3))
    turn[1:, 1] = 2 * np.cumsum(vectors[:-1, 0])
    back = rotations.exp(-turn)  # (T, 4) from the root's axes to the world's
    steps = np.zeros((len(vectors), 3))
    steps[1:, [0, 2]] = vectors[:-1, 1:3]
    root = np.cumsum(rotations.rotate(back, steps), axis=0)
    root[:, 1] = vectors[:, 3]
    own = vectors[:, 4 : 4 + 3 * (JOINTS - 1)].reshape(len(vectors), -1, 3)
    others = rotations.rotate(back[:, None], own) + root[:, None] * [1.0, 0.0, 1.0]
    return np.concatenate((root[:, None], others), axis=1)


def _check_lengths(content: Content, joints: Array, names: tuple[str, ...]) -> None:
    """Thighs and shanks have one length each: those of normalised vectors have not."""
    for a, b in (("hip", "knee"), ("knee", "ankle")):
        for side in ("left", "right"):
            bone = joints[:, names.index(f"{side}_{a}")] - joints[:, names.index(f"{side}_{b}")]
            length = np.linalg.norm(bone, axis=-1)
            if not np.std(length) <= STRETCH_MAX * np.mean(length):
                there = (
                    f"a {'thigh' if a == 'hip' else 'shank'} of {length.min():.2g} to {length.max():.2g} m"
                )
                valid = "vectors as they are published, not normalised (times Std.npy, plus Mean.npy)"
                raise content.fail("array", there, valid)
