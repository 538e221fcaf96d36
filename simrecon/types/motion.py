"""A motion, simulated or planned, and what is said of the run that made it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simrecon.types.arrays import Array, IntArray

SIMULATED, FALLBACK, PLANNED = 0, 1, 2
"""Values of `Motion.status`; where one frame is planned, all are: nothing was to be simulated."""
NO_STEP = -1
"""`Motion.frame_step` of a frame that was not simulated."""


@dataclass(frozen=True, eq=False)
class Motion:
    """What `motion.npz` holds (`simrecon.result/1`); shapes and units are in docs/formats.md.

    `kinematic_qpos` (T, nq) is the kinematic fit; None in results of earlier versions. `planned_qpos` (T, nq)
    is what a planner made of it for the simulation to follow; None where that is the fit. `restart_step` (R,)
    and `restart_state` (R, nstate) are where the simulation began anew after a gap; None without gaps.
    `band_*` and `contact_probability` are 90 % bands (docs/studies/bands.md); None where they are not known.
    """

    times_s: Array
    frame_step: IntArray
    status: NDArray[np.uint8]
    qpos: Array
    qvel: Array
    state0: Array
    ctrl: Array
    joint_names: tuple[str, ...]
    joints_m: Array
    com_m: Array
    torque_Nm: Array
    contact_body: tuple[str, ...]
    contact_force_N: Array
    contact_point_m: Array
    contact_slip_mps: Array
    grf_N: Array
    kinematic_qpos: Array | None = None
    planned_qpos: Array | None = None
    restart_step: IntArray | None = None
    restart_state: Array | None = None
    band_joints_m: Array | None = None
    band_grf_N: Array | None = None
    band_feet_N: Array | None = None
    contact_probability: Array | None = None

    @property
    def kept(self) -> NDArray[np.bool_]:
        """(T,) whether a frame shows what was asked for: the simulation, or the plan where that is all."""
        return np.asarray(self.status != FALLBACK)

    @property
    def is_planned(self) -> bool:
        """Whether nothing was to be simulated: the motion is what was planned."""
        return bool((self.status == PLANNED).all())

    @property
    def knows_forces(self) -> bool:
        """Whether forces and torques mean anything: those of a simulation, or of a planner that has some."""
        return not self.is_planned or bool(self.contact_force_N.any())

    @property
    def loaded(self) -> NDArray[np.bool_]:
        """(T,) whether a frame has forces of its own: it is no fallback, and no simulation begins there."""
        return np.asarray(self.kept & ~self.begins)

    @property
    def begins(self) -> NDArray[np.bool_]:
        """(T,) whether a simulation begins at a frame: it shows the forces of an instant, not of a frame."""
        steps = np.zeros(1) if self.restart_step is None else np.append(self.restart_step, 0)
        return np.asarray(np.isin(self.frame_step, steps))


Report = dict[str, Any]
