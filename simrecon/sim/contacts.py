"""The one reader of contacts: which parts touch what, how deep, with what force, and how fast they slip.

A caller says by an array over the geoms which part each belongs to, so the same reader serves a body's
primitives, a whole person, or several persons.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon.types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts between a part and what is none, c of them, in the order of the simulator.

    Attributes:
        rows: (c,) index of each in `data.contact`.
        part: (c,) id of the part; other: (c,) geom that it touches.
        is_second: (c,) whether the part is the contact's second geom, on which its force acts.
        depth_m: (c,) positive inside.
    """

    rows: IntArray
    part: IntArray
    other: IntArray
    is_second: NDArray[np.bool_]
    depth_m: Array


def find(data: mujoco.MjData, parts: IntArray) -> Contacts:
    """Contacts of exactly one part with what is none.

    Args:
        data: with contacts.
        parts: (ngeom,) id of the part that each geom belongs to, -1 for none.
    """
    pair = parts[data.contact.geom].reshape(-1, 2)  # (ncon, 2)
    rows = np.flatnonzero((pair >= 0).sum(axis=1) == 1)
    second = pair[rows, 1] >= 0
    geoms = data.contact.geom.reshape(-1, 2)[rows]
    other = np.where(second, geoms[:, 0], geoms[:, 1])
    return Contacts(rows, pair[rows].max(axis=1, initial=-1), other, second, -data.contact.dist[rows])


def deepest_between_parts_m(data: mujoco.MjData, parts: IntArray) -> float:
    """Depth of the deepest contact between two parts, 0 without; `parts` as of `find`."""
    own = (parts[data.contact.geom].reshape(-1, 2) >= 0).sum(axis=1)
    return max(0.0, -float(data.contact.dist[own == 2].min(initial=0.0)))


def forces(model: mujoco.MjModel, data: mujoco.MjData, contacts: Contacts) -> tuple[Array, Array]:
    """Force on the part of each contact, (c, 3) N in the world, and its normal component (c,) ≥ 0."""
    local = np.empty((len(contacts.rows), 6))
    for values, index in zip(local, contacts.rows, strict=True):
        mujoco.mj_contactForce(model, data, index, values)
    # the force of a contact acts on its second geom, with the axes of the contact as rows of its frame
    sign = np.where(contacts.is_second, 1.0, -1.0)[:, None]
    axes = data.contact.frame[contacts.rows].reshape(-1, 3, 3)
    return sign * (local[:, None, :3] @ axes)[:, 0], local[:, 0]


def slip_mps(model: mujoco.MjModel, data: mujoco.MjData, contacts: Contacts) -> Array:
    """Speed of the two sides of each contact along each other, (c,)."""
    geoms = data.contact.geom.reshape(-1, 2)[contacts.rows]
    places = data.contact.pos[contacts.rows]
    first, second = (_velocity(model, data, geoms[:, side], places) for side in (0, 1))  # (c, 3) each
    axes = data.contact.frame[contacts.rows].reshape(-1, 3, 3)
    along = (axes[:, 1:] @ (second - first)[..., None])[..., 0]  # (c, 2) in the contact's plane
    return np.asarray(np.linalg.norm(along, axis=-1))


def _velocity(model: mujoco.MjModel, data: mujoco.MjData, geoms: IntArray, points_m: Array) -> Array:
    """World velocity (c, 3) of points (c, 3) fixed to the bodies of geoms (c,)."""
    bodies = model.geom_bodyid[geoms]
    turning, moving = data.cvel[bodies, :3], data.cvel[bodies, 3:]
    arm = points_m - data.subtree_com[model.body_rootid[bodies]]
    return np.asarray(moving + np.cross(turning, arm))
