"""Poses on cubic Hermite splines, with nodes every few frames and their tangents (Xie 2021, section 3.2).

Between nodes k and k + 1, s of the way from one to the other, an unknown is

    h₀₀(s) v_k + h₁₀(s) m_k + h₀₁(s) v_{k+1} + h₁₁(s) m_{k+1}

with values v and tangents m, per distance of the nodes. So the unknowns of all frames are B c, with B the
same for each of them. A row of c is all values of a node, the next its tangents.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import splu

from simrecon.geometry import rotations
from simrecon.kinematics import layout
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.problem import Problem
from simrecon.types import Array, IntArray

ROWS = 4
"""Rows of c on which a frame depends: values and tangents of two nodes."""
NEAREST = 3
"""Frames from node to node: with fewer a spline has more unknowns than frames."""
RIDGE = 1e-9
"""Weight of c itself where it is fitted, which matters where a clip has fewer frames than c has rows."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Evenly spaced nodes over a clip.

    Attributes:
        first: (T,) first of the `ROWS` rows of c on which each frame depends.
        weights: (T, ROWS) how.
        count: of the rows of c.
    """

    first: IntArray
    weights: Array
    count: int

    @classmethod
    def spread(cls, frames: int, spacing: float) -> Nodes:
        """Over a clip of two or more frames: at most so many of them apart, and at least `NEAREST`."""
        wanted = math.ceil((frames - 1) / max(spacing, 1.0) - 1e-6)  # closer than frames is no closer
        pieces = max(min(wanted, (frames - 1) // NEAREST), 1)
        at = np.arange(frames) * (pieces / (frames - 1))
        piece = np.minimum(at.astype(np.intp), pieces - 1)
        s = at - piece
        weights = (2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, 3 * s**2 - 2 * s**3, s**3 - s**2)
        return cls(2 * piece, np.stack(weights, axis=1), 2 * (pieces + 1))

    @cached_property
    def basis(self) -> csr_array:
        """B (T, count)."""
        columns = self.first[:, None] + np.arange(ROWS)
        ends = np.arange(len(self.first) + 1) * ROWS
        return csr_array((self.weights.ravel(), columns.ravel(), ends), shape=(len(self.first), self.count))

    def nearest(self, values: Array) -> Array:
        """The c (count, n) whose B c is nearest to values (T, n), by least squares."""
        normal = self.basis.T @ self.basis + RIDGE * eye_array(self.count)
        return np.asarray(splu(normal.tocsc()).solve(self.basis.T @ values))

    def smoothed(self, values: Array) -> Array:
        """Values (T, n) on the nearest spline."""
        return np.asarray(self.basis @ self.nearest(values))


def laid(problem: Problem, variables: Variables, nodes: Nodes) -> tuple[Problem, Variables]:
    """A motion on the splines next to it, which is where a search over them begins.

    The root's orientation comes as the spline of its quaternions, and turns are counted from there: of a root
    that turns around more than once no rotation vector changes steadily.

    Args:
        problem: whose `base` is the root's orientation.
        variables: the motion; the rotation vectors of the root are zero.
        nodes: of the splines.
    """
    turns = _steady(rotations.from_matrix(problem.base))
    smooth = nodes.smoothed(turns)
    base = rotations.matrix(smooth / np.linalg.norm(smooth, axis=1, keepdims=True))
    joints = np.swapaxes(unwound(variables.rotvecs[1:]), 0, 1).reshape(problem.frames, -1)  # (T, 3 JOINTS)
    rotvecs = np.zeros_like(variables.rotvecs)
    rotvecs[1:] = np.swapaxes(nodes.smoothed(joints).reshape(problem.frames, -1, layout.AXES), 0, 1)
    root_m = nodes.smoothed(variables.root_m)
    return replace(problem, base=base), replace(variables, root_m=root_m, rotvecs=rotvecs)


def _steady(turns: Array) -> Array:
    """Quaternions (T, 4), each with the sign that is next to the one before it."""
    flips = np.where(np.sum(turns[1:] * turns[:-1], axis=1) < 0, -1.0, 1.0)
    return turns * np.cumprod(np.concatenate(([1.0], flips)))[:, None]


def unwound(rotvecs: Array) -> Array:
    """Rotation vectors (N, T, 3) of the same rotations, each next to the one before it.

    A vector and the one that turns the other way round, v (1 - 2 π / ‖v‖), are the same rotation.
    """
    found = rotvecs.copy()
    for t in range(1, found.shape[1]):
        before, now = found[:, t - 1], found[:, t]
        size = np.linalg.norm(now, axis=1, keepdims=True)
        axis = now / np.maximum(size, 1e-12)
        rounds = np.round((np.sum(axis * before, axis=1, keepdims=True) - size) / (2 * np.pi))
        found[:, t] = np.where(size > 1e-6, now + 2 * np.pi * rounds * axis, now)
    return found
