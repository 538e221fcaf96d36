"""Who is where in a model: the coordinates, sites and geoms of a person among all that moves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

from simrecon.types import Array, IntArray


@dataclass(frozen=True)
class Address:
    """Where a person's tree of bodies lies in a model.

    Attributes:
        body: id of the pelvis, the root of the tree.
        qpos, qvel: the person's coordinates in `qpos` (nq,) and `qvel` (nv,).
        prefix: of the names of the person's bodies, sites and geoms.
    """

    body: int
    qpos: slice
    qvel: slice
    prefix: str = ""

    @property
    def nq(self) -> int:
        """How many coordinates the person has."""
        return int(self.qpos.stop - self.qpos.start)

    @property
    def nv(self) -> int:
        """How many degrees of freedom the person has."""
        return int(self.qvel.stop - self.qvel.start)

    def sites(self, model: mujoco.MjModel, names: Iterable[str]) -> IntArray:
        """Ids of the person's sites (M,), by name without the prefix."""
        return np.array([model.site(self.prefix + name).id for name in names], np.int64)

    def geoms(self, model: mujoco.MjModel, names: Iterable[str]) -> IntArray:
        """Ids of the person's geoms (C,), by name without the prefix."""
        return np.array([model.geom(self.prefix + name).id for name in names], np.int64)

    def own_geoms(self, model: mujoco.MjModel) -> Array:
        """Which geoms are the person's, (ngeom,) bool."""
        return np.asarray(model.body_rootid[model.geom_bodyid] == self.body)

    def mass_kg(self, model: mujoco.MjModel) -> float:
        """Mass of the whole person."""
        return float(model.body_subtreemass[self.body])


def locate(model: mujoco.MjModel, prefix: str = "") -> Address:
    """Find a person in a model.

    Args:
        model: of one person or several, in a scene.
        prefix: of the person's names; without one, the person is the tree of the first joint.

    Raises:
        KeyError: no body has the name of a pelvis with this prefix.
    """
    pelvis = model.body(f"{prefix}pelvis").id if prefix else model.body_rootid[model.jnt_bodyid[0]]
    root = int(pelvis)
    own = np.flatnonzero(model.body_rootid[model.jnt_bodyid] == root)  # joints, consecutive
    first, after = int(own[0]), int(own[-1]) + 1
    end_q, end_v = (
        (model.nq, model.nv)
        if after == model.njnt
        else (int(model.jnt_qposadr[after]), int(model.jnt_dofadr[after]))
    )
    qpos = slice(int(model.jnt_qposadr[first]), end_q)
    return Address(root, qpos, slice(int(model.jnt_dofadr[first]), end_v), prefix)


def with_items_at_rest(model: mujoco.MjModel, qpos: Array) -> Array:
    """Configurations (T, nq) of the model: the person's (T, person nq), and all else that moves at rest."""
    own = locate(model).qpos
    full = np.tile(model.qpos0, (len(qpos), 1))
    full[:, own] = qpos
    return full


def motor_dofs(model: mujoco.MjModel) -> IntArray:
    """Degree of freedom of each motor on a ball joint, (nu,): that of the axis of its gear."""
    axis = np.argmax(np.abs(model.actuator_gear[:, :3]), axis=1)
    return np.asarray(model.jnt_dofadr[model.actuator_trnid[:, 0]] + axis, np.int64)
