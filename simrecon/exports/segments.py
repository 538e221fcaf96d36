"""Segments of the body in the world, from configurations and back, and how fast they move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simrecon.geometry import rotations
from simrecon.types import Array, Skeleton


@dataclass(frozen=True, eq=False)
class Segments:
    """All frames.

    Attributes:
        origins_m: (G, S, 3) joint centres in the world.
        quats: (G, S, 4) of the segments in the world, w x y z.
    """

    origins_m: Array
    quats: Array


def of(skeleton: Skeleton, qpos: Array) -> Segments:
    """Segments of configurations (G, nq)."""
    local = rotations.multiply(skeleton.rest, qpos[:, 3:].reshape(len(qpos), -1, 4))
    origins, quats = np.empty((*local.shape[:2], 3)), np.empty_like(local)
    origins[:, 0], quats[:, 0] = qpos[:, :3], local[:, 0]
    for b in range(1, local.shape[1]):
        parent = skeleton.parents[b]
        origins[:, b] = origins[:, parent] + rotations.rotate(quats[:, parent], skeleton.offsets_m[b])
        quats[:, b] = rotations.multiply(quats[:, parent], local[:, b])
    return Segments(origins, quats)


def configurations(skeleton: Skeleton, root_m: Array, quats: Array) -> Array:
    """The configurations (G, nq) of segments: place of the root (G, 3), orientations (G, S, 4)."""
    inside = np.empty_like(quats)
    inside[:, 0] = quats[:, 0]
    for b in range(1, quats.shape[1]):
        before = rotations.multiply(quats[:, skeleton.parents[b]], skeleton.rest[b])
        inside[:, b] = rotations.multiply(rotations.conjugate(before), quats[:, b])
    return np.concatenate((root_m, rotations.canonical(inside).reshape(len(quats), -1)), axis=1)


def points(skeleton: Skeleton, posed: Segments) -> Array:
    """The skeleton's points (G, M, 3)."""
    at = skeleton.point_segments
    return np.asarray(posed.origins_m[:, at] + rotations.rotate(posed.quats[:, at], skeleton.point_offsets_m))


def local(parents: Sequence[int], quats: Array) -> Array:
    """Orientations in the world (G, B, 4) → in the parents; the first one is the root's, in the world."""
    inside = np.empty_like(quats)
    inside[:, 0] = quats[:, 0]
    for b in range(1, quats.shape[1]):
        inside[:, b] = rotations.multiply(rotations.conjugate(quats[:, parents[b]]), quats[:, b])
    return rotations.canonical(inside)


def rates(values: Array, interval_s: float) -> Array:
    """Time derivative of (G, ...): central differences, one-sided at the ends."""
    return np.asarray(np.gradient(values, interval_s, axis=0))


def turn_rates(quats: Array, interval_s: float) -> Array:
    """Angular velocity in the frame that orientations (G, ..., 4) are given in, rad/s; as `rates`."""
    after = np.minimum(np.arange(len(quats)) + 1, len(quats) - 1)
    before = np.maximum(np.arange(len(quats)) - 1, 0)
    turned = rotations.log(rotations.multiply(quats[after], rotations.conjugate(quats[before])))
    span_s = ((after - before) * interval_s).reshape(-1, *(1,) * (quats.ndim - 1))
    return np.asarray(turned / span_s)
