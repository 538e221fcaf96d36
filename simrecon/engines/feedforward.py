"""The torques that a planned motion takes, so that the servos need not wait for an error to exert them."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simrecon.sim.address import locate, motor_dofs
from simrecon.sim.inverse_dynamics import inverse
from simrecon.types import Array, Reference

SMOOTH_S = 0.02
"""Standard deviation of a Gaussian: second differences of frames are rough."""


def torques(model: mujoco.MjModel, qpos: Array, reference: Reference) -> Array | None:
    """Torques of the motors (T, nu), Nm, within their limits; None where the planner knows no forces.

    Args:
        model: as of `needed`.
        qpos: as of `needed`.
        reference: as of `needed`.
    """
    taken = needed(model, qpos, reference)
    if taken is None:
        return None
    low, high = model.actuator_forcerange.T
    return np.asarray(np.clip(taken, low, high))


def needed(model: mujoco.MjModel, qpos: Array, reference: Reference) -> Array | None:
    """Torques of the motors (T, nu), Nm, that a plan takes; None where the planner knows no forces.

    Args:
        model: of person and scene.
        qpos: (T, nq) configurations of the model.
        reference: with forces of the scene on the person, on the same frames.
    """
    if reference.contact_force_N is None or reference.contact_place_m is None:
        return None
    interval_s = float(reference.times_s[1] - reference.times_s[0])
    bodies = np.array([model.body(locate(model).prefix + name).id for name in reference.contact_segments])
    forces = inverse(model, qpos, interval_s, bodies, reference.contact_place_m, reference.contact_force_N)
    return np.asarray(
        gaussian_filter1d(forces[:, motor_dofs(model)], SMOOTH_S / interval_s, axis=0, mode="nearest")
    )
