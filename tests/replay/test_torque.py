"""The torque that is reported is the one that moves the body."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon import body
from simrecon.replay.trace import _acting_torque


def test_the_torque_accounts_for_the_acceleration(rng: np.random.Generator) -> None:
    person = body.build(body.scaled({}, 1.7), height_m=1.7, mass_kg=64.0, sole_m=0.0)
    spec = mujoco.MjSpec.from_string(person.mjcf)
    spec.option.timestep = 0.01
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:] = 0.3 * rng.normal(size=model.nv)
    for step in range(5):
        data.ctrl[:] = 0.4 * rng.normal(size=model.nu) * (step + 1)
        before = mujoco.MjData(model)
        before.qpos[:], before.qvel[:] = data.qpos, data.qvel
        mujoco.mj_forward(model, before)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, before, mass)
        mujoco.mj_step(model, data)
        torque = _acting_torque(model, data, before.qvel)
        needed = mass @ (data.qvel - before.qvel) / 0.01 + before.qfrc_bias + model.dof_damping * data.qvel
        np.testing.assert_allclose(torque, needed[6:], atol=1e-6 * np.abs(needed).max())
        assert np.abs(torque - data.actuator_force).max() > 1.0
