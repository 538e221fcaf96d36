"""Unknowns of the kinematic fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array, IntArray

LEAN_PERIOD_S = 1.0
LEANS_MAX = 32  # of 16 s; in a longer clip the lean changes more slowly, or cost would grow with the square


@dataclass(frozen=True, eq=False)
class Variables:
    """Unknowns of the fit.

    Attributes:
        root_m: (T, 3); rotvecs: (17, T, 3).
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
        shared = ([self.log_scale, self.sole_m], self.lengths, self.lean.ravel())
        return np.concatenate((self.root_m.ravel(), self.rotvecs.ravel(), *shared))

    def part(self, frames: slice | IntArray) -> Variables:
        """Those of some frames, and the shared ones."""
        return replace(self, root_m=self.root_m[frames], rotvecs=self.rotvecs[:, frames])

    @staticmethod
    def unpack(x: Array, frames: int, lengths: int) -> Variables:
        """From one vector of `frames` frames and `lengths` lengths."""
        places, shared = 3 * frames, 54 * frames
        return Variables(
            x[:places].reshape(frames, 3),
            x[places:shared].reshape(17, frames, 3),
            float(x[shared]),
            float(x[shared + 1]),
            x[shared + 2 : shared + 2 + lengths],
            x[shared + 2 + lengths :].reshape(-1, 3),
        )


def leans(frames: int, interval_s: float) -> Array:
    """Slow cosines of a clip (T, F), the first one constant; each of root mean square one."""
    count = min(1 + int(2 * frames * interval_s / LEAN_PERIOD_S), LEANS_MAX)
    phase = np.pi * (np.arange(frames)[:, None] + 0.5) / frames * np.arange(min(count, frames))  # (T, F)
    return np.where(np.arange(phase.shape[1]) > 0, np.sqrt(2.0), 1.0) * np.cos(phase)


def to_qpos(root_m: Array, base: Array, rotvecs: Array) -> Array:
    """Joint configuration (T, 7 + 4·16) of MuJoCo from the fit's variables."""
    root = rotations.canonical(rotations.multiply(rotations.from_matrix(base), rotations.exp(rotvecs[0])))
    joints = rotations.exp(np.swapaxes(rotvecs[1:], 0, 1))  # (T, 16, 4)
    return np.concatenate((root_m, root, joints.reshape(len(root_m), -1)), axis=1)
