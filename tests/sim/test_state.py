"""Full states: their configurations and velocities, and offsets from them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from simrecon.sim.state import displace, initial_state, qpos_of, qvel_of

FREE = """
<mujoco>
  <worldbody>
    <body>
      <freejoint/>
      <geom size="0.1"/>
      <body pos="1 0 0"><joint type="hinge" axis="0 0 1"/><geom size="0.1"/></body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(FREE)


def test_parts_of_a_state_are_what_it_was_made_of_and_views(model: mujoco.MjModel) -> None:
    qpos, qvel = np.array([1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.5]), np.arange(7.0)
    states = np.stack([initial_state(model, qpos, qvel), initial_state(model, model.qpos0, 0 * qvel)])
    np.testing.assert_array_equal(qpos_of(model, states[0]), qpos)
    np.testing.assert_array_equal(qvel_of(model, states), [qvel, 0 * qvel])
    qvel_of(model, states)[1] = 3.0
    assert (qvel_of(model, states[1]) == 3.0).all()


def test_offsets_turn_by_rotation_vectors_and_add_up_elsewhere(model: mujoco.MjModel) -> None:
    states = np.repeat(initial_state(model, model.qpos0, np.ones(7))[None], 2, axis=0)
    pose = np.array([[1.0, 2.0, 3.0, 0.0, 0.0, np.pi / 2, 0.25], np.zeros(7)])
    displace(model, states, pose, np.array([np.arange(7.0), np.zeros(7)]))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(qpos_of(model, states[0]), [1, 2, 3, half, 0, 0, half, 0.25], atol=1e-12)
    np.testing.assert_array_equal(qvel_of(model, states[0]), 1 + np.arange(7.0))
    np.testing.assert_array_equal(states[1], initial_state(model, model.qpos0, np.ones(7)))
