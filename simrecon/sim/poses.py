"""Poses without dynamics: what configurations show, and velocities by finite differences."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from simrecon.types import Array, IntArray


def posed(model: mujoco.MjModel, qpos: Array, qvel: Array | None = None) -> Iterator[mujoco.MjData]:
    """Data at each configuration, with kinematics and centres of mass; one object, overwritten at each.

    Args:
        model: of `qpos`.
        qpos: (T, nq).
        qvel: (T, nv) velocities, with which the velocities of bodies and subtrees are known too; or None.
    """
    data = mujoco.MjData(model)
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        if qvel is not None:
            data.qvel[:] = qvel[frame]
            mujoco.mj_comVel(model, data)
            mujoco.mj_subtreeVel(model, data)
        yield data


def touching(model: mujoco.MjModel, qpos: Array) -> Iterator[mujoco.MjData]:
    """Data at each configuration (T, nq), with contacts too; one object, overwritten at each."""
    data = mujoco.MjData(model)
    for configuration in qpos:
        data.qpos[:] = configuration
        mujoco.mj_fwdPosition(model, data)
        yield data


def at_rest(model: mujoco.MjModel) -> mujoco.MjData:
    """Data at the model's own configuration `qpos0`."""
    return next(posed(model, model.qpos0[None]))


def sites_and_com(model: mujoco.MjModel, qpos: Array, sites: IntArray, body: int) -> tuple[Array, Array]:
    """Positions of sites (T, M, 3) and the centre of mass (T, 3) of the tree below a body, m.

    Args:
        model: of `qpos`.
        qpos: (T, nq).
        sites: (M,) ids.
        body: id of the root of the tree.
    """
    points, com = np.empty((len(qpos), len(sites), 3)), np.empty((len(qpos), 3))
    for frame, data in enumerate(posed(model, qpos)):
        points[frame], com[frame] = data.site_xpos[sites], data.subtree_com[body]
    return points, com


def differentiate(model: mujoco.MjModel, qpos: Array, interval_s: float) -> Array:
    """Velocities (T, nv) of configurations (T, nq) by finite differences: central, one-sided at the ends."""
    count = len(qpos)
    rates = np.empty((count, model.nv))
    for frame in range(count):
        first, last = max(frame - 1, 0), min(frame + 1, count - 1)
        mujoco.mj_differentiatePos(model, rates[frame], (last - first) * interval_s, qpos[first], qpos[last])
    return rates
