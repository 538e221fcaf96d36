"""Names, sizes and order of the unknowns of the kinematic fit; only this module packs and unpacks them.

Packed, a clip of T frames is one vector: places of the root (T, 3), rotation vectors of the segments, root
first, (SEGMENTS, T, 3), and what all frames share, (m,): log scale, sole, lengths (L,), lean (F, 3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array, IntArray

AXES = 3
SEGMENTS = 17
"""The pelvis, which is the root, and one for each joint."""
JOINTS = SEGMENTS - 1
FREE = AXES + AXES * SEGMENTS
"""Unknowns of a frame: the root's place, and the rotation vectors of all segments."""
ROOT = slice(0, 2 * AXES)
"""Of a frame's unknowns: place and turn of the root."""
JOINT_TURNS = slice(2 * AXES, FREE)
"""Of a frame's unknowns: rotation vectors of the joints."""
LOG_SCALE, SOLE, LENGTHS = 0, 1, 2
"""Places among the shared unknowns; lengths begin at theirs, and the lean follows them."""
LEAN = 3
"""Directions in which the 3D estimate of a frame leans."""

LEAN_PERIOD_S = 1.0
LEANS_MAX = 32  # of 16 s; in a longer clip the lean changes more slowly, or cost would grow with the square


@dataclass(frozen=True, eq=False)
class Variables:
    """Unknowns of the fit.

    Attributes:
        root_m: (T, 3); rotvecs: (SEGMENTS, T, 3).
        log_scale: natural logarithm of the skeleton's scale; sole_m: how far the sole is below its place.
        lengths: (L,) natural logarithms of factors on the skeleton's lengths (`bodies.length_offsets`).
        lean: (F, 3) cosine coefficients of the rotation vector by which the 3D estimate is turned.
    """

    root_m: Array
    rotvecs: Array
    log_scale: float
    sole_m: float
    lengths: Array
    lean: Array

    def pack(self) -> Array:
        """As one vector."""
        shared = np.concatenate(([self.log_scale, self.sole_m], self.lengths, self.lean.ravel()))
        return join(self.root_m, self.rotvecs, shared)

    def part(self, frames: slice | IntArray) -> Variables:
        """Those of some frames, and the shared ones."""
        return replace(self, root_m=self.root_m[frames], rotvecs=self.rotvecs[:, frames])

    @staticmethod
    def unpack(x: Array, frames: int, lengths: int) -> Variables:
        """From one vector of `frames` frames and `lengths` lengths."""
        root, rotvecs, shared = split(x, frames)
        after = LENGTHS + lengths
        return Variables(
            root,
            rotvecs,
            float(shared[LOG_SCALE]),
            float(shared[SOLE]),
            shared[LENGTHS:after],
            shared[after:].reshape(-1, LEAN),
        )


def split(x: Array, frames: int) -> tuple[Array, Array, Array]:
    """Views of a packed vector: places (T, 3), rotation vectors (SEGMENTS, T, 3), shared unknowns (m,)."""
    places, own = AXES * frames, FREE * frames
    return x[:places].reshape(frames, AXES), x[places:own].reshape(SEGMENTS, frames, AXES), x[own:]


def join(root_m: Array, rotvecs: Array, shared: Array) -> Array:
    """The inverse of `split`."""
    return np.concatenate((root_m.ravel(), rotvecs.ravel(), shared))


def by_frame(x: Array, frames: int) -> tuple[Array, Array]:
    """A packed vector as the unknowns of one frame after the other (FREE·T,), and the shared ones (m,)."""
    root, rotvecs, shared = split(x, frames)
    own = np.concatenate((root, np.swapaxes(rotvecs, 0, 1).reshape(frames, -1)), axis=1)  # (T, FREE)
    return own.ravel(), shared


def from_frames(own: Array, shared: Array) -> Array:
    """The inverse of `by_frame`."""
    by_time = own.reshape(-1, FREE)
    rotvecs = np.swapaxes(by_time[:, AXES:].reshape(len(by_time), SEGMENTS, AXES), 0, 1)
    return join(by_time[:, :AXES], rotvecs, shared)


def turn(segment: int, axis: int) -> int:
    """Place of a component of a segment's rotation vector among the unknowns of its frame."""
    return AXES + AXES * segment + axis


def leans(frames: int, interval_s: float) -> Array:
    """Slow cosines of a clip (T, F), the first one constant; each of root mean square one."""
    count = min(1 + int(2 * frames * interval_s / LEAN_PERIOD_S), LEANS_MAX)
    phase = np.pi * (np.arange(frames)[:, None] + 0.5) / frames * np.arange(min(count, frames))  # (T, F)
    return np.where(np.arange(phase.shape[1]) > 0, np.sqrt(2.0), 1.0) * np.cos(phase)


def to_qpos(root_m: Array, base: Array, rotvecs: Array) -> Array:
    """Joint configurations (T, nq) of MuJoCo, from the root's place (T, 3) and rotation vectors over `base`.

    Args:
        root_m: (T, 3).
        base: (T, 3, 3) orientation from which the root's rotation vector is counted.
        rotvecs: (SEGMENTS, T, 3).
    """
    root = rotations.canonical(rotations.multiply(rotations.from_matrix(base), rotations.exp(rotvecs[0])))
    joints = rotations.exp(np.swapaxes(rotvecs[1:], 0, 1))  # (T, JOINTS, 4)
    return np.concatenate((root_m, root, joints.reshape(len(root_m), -1)), axis=1)


def from_qpos(qpos: Array) -> tuple[Array, Array, Array]:
    """The arguments of `to_qpos` that give configurations (T, nq); the root's rotation is all in `base`."""
    root, turns = qpos[:, :AXES], qpos[:, AXES:].reshape(len(qpos), SEGMENTS, 4)
    rotvecs = np.zeros((SEGMENTS, len(qpos), AXES))
    rotvecs[1:] = np.swapaxes(rotations.log(turns[:, 1:]), 0, 1)
    return root, rotations.matrix(turns[:, 0]), rotvecs
