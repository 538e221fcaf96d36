"""Force of each item of a scene, and of the ground, on the person, read off a replay.

Axes: T frames, N simulation steps, I items.
"""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.replay import SIMULATED, Gaps, gaps_of, mean_since
from simrecon.scene import check
from simrecon.sim import contacts
from simrecon.sim.state import set_state
from simrecon.types import Array, Motion, Scene


def forces(model: mujoco.MjModel, scene: Scene, state0: Array, ctrl: Array, gaps: Gaps = ()) -> Array:
    """Force on the person in every step of a replay, (N + 1, I + 1, 3) N: of each item, and of the ground.

    Row k acted from state k - 1 to state k; row 0 is zero.

    Args:
        model: of person and scene.
        scene: that it was built from.
        state0: (nstate,) full state.
        ctrl: (N, nu).
        gaps: of the simulation, whose rows are zero.
    """
    owners = check.owners(model, scene)
    person = np.where(owners < 0, 0, -1)  # (ngeom,)
    rows = np.zeros((len(ctrl) + 1, len(scene.items) + 1, 3))
    data = mujoco.MjData(model)
    set_state(model, data, state0)
    anew = {begin: state for _, begin, state in gaps}
    for k, (row, control) in enumerate(zip(rows[1:], ctrl, strict=True), start=1):
        if k in anew:
            set_state(model, data, anew[k])
        if any(last < k <= begin for last, begin, _ in gaps):
            continue
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        touching = contacts.find(data, person)
        np.add.at(row, owners[touching.other], contacts.forces(model, data, touching)[0])
    return rows


def loads(model: mujoco.MjModel, scene: Scene, motion: Motion) -> Array:
    """Force of each item on the person, mean since the previous frame, (T, I, 3) N.

    Fallback frames are zero; the ground is no item.

    Args:
        model: of person and scene.
        scene: that it was built from.
        motion: which is replayed.
    """
    rows = forces(model, scene, motion.state0, motion.ctrl, gaps_of(motion))[:, :-1]
    means = np.zeros((len(motion.times_s), *rows.shape[1:]))
    kept = motion.status == SIMULATED
    means[kept] = mean_since(rows, motion.frame_step[kept], motion.restart_step)
    return means
