"""Parallel rollouts against the plain loop, bit for bit."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from simrecon.geometry import rotations
from simrecon.sim import rollout
from simrecon.sim.poses import differentiate
from simrecon.sim.rollout import Rollouts, Simulator
from simrecon.sim.state import component, forward, get_state, initial_state, set_state, simulate
from simrecon.types import Array

XML = """
<mujoco>
  <compiler autolimits="true" angle="radian"/>
  <option timestep="0.01" integrator="discrete"/>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="trunk" pos="0 0 0.35">
      <freejoint/>
      <geom type="capsule" fromto="-0.2 0 0 0.2 0 0" size="0.1" mass="5"/>
      <site name="front" pos="0.2 0 0"/>
      <body name="arm" pos="0.3 0 0">
        <joint name="shoulder" type="ball" range="0 2" damping="0.1" armature="0.01"/>
        <geom type="box" pos="0.15 0 0" size="0.15 0.04 0.04" mass="1"/>
        <site name="hand" pos="0.3 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" gear="1 0 0 0 0 0" kp="20" kv="1"/>
    <position joint="shoulder" gear="0 1 0 0 0 0" kp="20" kv="1"/>
    <position joint="shoulder" gear="0 0 1 0 0 0" kp="20" kv="1"/>
  </actuator>
</mujoco>
"""
P, N = 5, 60
AT = np.array([1, 2, 30, 59])


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(XML)


@pytest.fixture
def state(model: mujoco.MjModel) -> Array:
    """In the air, turning: it hits the floor on the way."""
    velocity = np.zeros(model.nv)
    velocity[:6] = [0.5, 0.0, -1.0, 1.0, 2.0, 0.0]
    qpos = model.qpos0.copy()
    qpos[7:11] = rotations.exp(np.array([0.2, -0.3, 0.4]))
    return initial_state(model, qpos, velocity)


@pytest.fixture
def ctrl(rng: np.random.Generator) -> Array:
    return rng.uniform(-1, 1, (P, N, 3))


def plain(model: mujoco.MjModel, state: Array, ctrl: Array) -> Rollouts:
    """What `Simulator.run` should return, by plain loops; derived fields by a forward of their own."""
    qpos, points, com = list[Array](), list[Array](), list[Array]()
    for row in ctrl:
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        after = []
        for step in row:
            data.ctrl[:] = step
            mujoco.mj_step(model, data)
            here = mujoco.MjData(model)
            here.qpos[:] = data.qpos
            mujoco.mj_forward(model, here)
            after.append((here.qpos.copy(), here.site_xpos.copy(), here.subtree_com[1].copy()))
        for found, values in zip((qpos, points, com), zip(*after, strict=True), strict=True):
            found.append(np.stack(values)[AT - 1])
    unfelt, finite = np.zeros((len(ctrl), len(AT), 0, 6)), np.ones(len(ctrl), dtype=bool)
    return Rollouts(np.stack(qpos), np.stack(points), np.stack(com), finite, unfelt)


def assert_same(found: Rollouts, expected: Rollouts) -> None:
    np.testing.assert_array_equal(found.qpos, expected.qpos)
    np.testing.assert_array_equal(found.points_m, expected.points_m)
    np.testing.assert_array_equal(found.com_m, expected.com_m)
    np.testing.assert_array_equal(found.finite, expected.finite)


@pytest.mark.parametrize("threads", [1, 2])
def test_rollouts_are_the_plain_loop_bit_for_bit(
    model: mujoco.MjModel, state: Array, ctrl: Array, threads: int
) -> None:
    simulator = Simulator(model, P, threads)
    expected = plain(model, state, ctrl)
    first = simulator.run(state, ctrl, AT)
    assert_same(first, expected)
    assert first.qpos.shape == (P, len(AT), model.nq)
    assert first.points_m.shape == (P, len(AT), 2, 3)
    assert first.com_m.shape == (P, len(AT), 3)
    assert simulator.steps == P * N
    assert simulator.seconds > 0
    # neither what was simulated before nor who shares the pool matters, and results are not overwritten
    again = simulator.run(state, ctrl[::-1].copy(), AT)
    np.testing.assert_array_equal(again.qpos[::-1], expected.qpos)
    assert_same(first, expected)


def test_a_smaller_population_runs_too(model: mujoco.MjModel, state: Array, ctrl: Array) -> None:
    simulator = Simulator(model, P, 1)
    simulator.run(state, ctrl, AT)
    assert_same(simulator.run(state, ctrl[:2], AT), plain(model, state, ctrl[:2]))


def test_work_goes_on_with_other_numbers_of_threads(model: mujoco.MjModel, state: Array, ctrl: Array) -> None:
    wanted = [1]
    simulator = Simulator(model, P, lambda: wanted[0])
    whole = simulator.run(state, ctrl, AT)
    for wanted[0] in (3, 2, 9, 1):
        parts = simulator.each(
            lambda part: simulator.run(state, ctrl[part], AT).qpos, rollout.pieces(len(ctrl), P)
        )
        np.testing.assert_array_equal(np.concatenate(parts), whole.qpos)
        assert simulator.threads == wanted[0]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_piece_that_fails_says_so_and_harms_no_other(
    model: mujoco.MjModel, state: Array, ctrl: Array, threads: int
) -> None:
    simulator = Simulator(model, P, threads)

    def work(part: slice) -> Array:
        return simulator.run(state, ctrl[part, :, : 2 if part.start == 0 else 3], AT).qpos

    for _ in range(3):
        with pytest.raises(ValueError, match="broadcast"):
            simulator.each(work, rollout.pieces(len(ctrl), P))
        assert mujoco.MjLogConfig.get().logto_console
    assert_same(simulator.run(state, ctrl, AT), plain(model, state, ctrl))


@pytest.mark.parametrize(("count", "most"), [(1, 50), (3, 50), (18, 50), (50, 50), (432, 50)])
def test_pieces_are_all_samples_in_order(count: int, most: int) -> None:
    parts = rollout.pieces(count, most)
    assert np.concatenate([np.arange(count)[part] for part in parts]).tolist() == list(range(count))
    sizes = [part.stop - part.start for part in parts]
    assert max(sizes) <= most
    assert max(sizes) - min(sizes) <= 1
    assert len(parts) >= min(rollout.PIECES, count)


def test_the_arm_really_moves_the_trunk(model: mujoco.MjModel, state: Array, ctrl: Array) -> None:
    found = Simulator(model, P, 1).run(state, ctrl, AT)
    assert np.ptp(found.points_m[:, -1], axis=0).max() > 0.01
    data = forward(model, simulate(model, state, ctrl[0])[AT[-1]])
    assert data.ncon > 0


def test_rollouts_that_diverge_are_flagged_and_harm_no_other(
    model: mujoco.MjModel, state: Array, ctrl: Array
) -> None:
    simulator = Simulator(model, P, 1)
    expected = plain(model, state, ctrl)
    wild = ctrl.copy()
    wild[1, 20:] = 1e30
    wild[3, 5] = np.nan
    found = simulator.run(state, wild, AT)
    assert found.finite.tolist() == [True, False, True, False, True]
    np.testing.assert_array_equal(found.qpos[[0, 2, 4]], expected.qpos[[0, 2, 4]])
    # again and again, and not for ever
    for _ in range(2):
        assert simulator.run(state, wild, AT).finite.tolist() == [True, False, True, False, True]
    assert_same(simulator.run(state, ctrl, AT), expected)


@pytest.mark.parametrize("speed", [1e4, 1e12])
def test_a_state_that_can_not_be_stepped_is_flagged_every_time(
    model: mujoco.MjModel, ctrl: Array, speed: float
) -> None:
    wild = initial_state(model, model.qpos0, np.full(model.nv, speed))
    simulator = Simulator(model, P, 1)
    for _ in range(3):
        assert not simulator.run(wild, ctrl, AT).finite.any()


def test_the_first_step_is_the_state_itself(model: mujoco.MjModel, state: Array, ctrl: Array) -> None:
    states = np.stack([state, simulate(model, state, ctrl[0])[7]])
    found = Simulator(model, P, 1).run(states, ctrl[:2], np.array([0, 3]))
    for row in range(2):
        data = forward(model, states[row])
        np.testing.assert_array_equal(found.qpos[row, 0], data.qpos)
        np.testing.assert_array_equal(found.points_m[row, 0], data.site_xpos)
        np.testing.assert_array_equal(found.com_m[row, 0], data.subtree_com[1])
        later = simulate(model, states[row], ctrl[row, :3])[3]
        np.testing.assert_array_equal(
            found.qpos[row, 1], component(model, later, mujoco.mjtState.mjSTATE_QPOS)
        )


def test_divergence_leaves_no_log_behind(
    model: mujoco.MjModel,
    state: Array,
    ctrl: Array,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    wild = np.full_like(ctrl, 1e30)
    assert not Simulator(model, P, 2).run(state, wild, AT).finite.any()
    simulate(model, state, wild[0])
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")
    assert mujoco.MjLogConfig.get().logto_console


def test_replay_resumes_exactly_from_any_state(model: mujoco.MjModel, state: Array, ctrl: Array) -> None:
    states = simulate(model, state, ctrl[0])
    assert states.shape == (N + 1, len(state))
    np.testing.assert_array_equal(states[0], state)
    for middle in (1, 25, 59):
        np.testing.assert_array_equal(simulate(model, states[middle], ctrl[0, middle:]), states[middle:])


def test_replay_is_what_the_simulator_did(model: mujoco.MjModel, state: Array, ctrl: Array) -> None:
    found = Simulator(model, P, 1).run(state, ctrl, AT)
    for row in range(P):
        states = simulate(model, state, ctrl[row])
        np.testing.assert_array_equal(
            component(model, states, mujoco.mjtState.mjSTATE_QPOS)[AT], found.qpos[row]
        )


def test_the_warm_start_is_part_of_the_state(model: mujoco.MjModel, state: Array, ctrl: Array) -> None:
    states = simulate(model, state, ctrl[0])
    warm = component(model, states, mujoco.mjtState.mjSTATE_WARMSTART)
    assert np.abs(warm[30]).max() > 0
    which = mujoco.mjtState
    for part in (which.mjSTATE_TIME, which.mjSTATE_QPOS, which.mjSTATE_QVEL, which.mjSTATE_WARMSTART):
        data = forward(model, states[30])
        set_state(model, data, states[30])
        expected = np.empty(mujoco.mj_stateSize(model, part))
        mujoco.mj_getState(model, data, expected, part)
        np.testing.assert_array_equal(component(model, states, part)[30], expected)


def test_a_state_survives_the_round_trip(model: mujoco.MjModel, state: Array) -> None:
    data = mujoco.MjData(model)
    set_state(model, data, state)
    np.testing.assert_array_equal(get_state(model, data), state)
    np.testing.assert_array_equal(data.qvel[:6], [0.5, 0.0, -1.0, 1.0, 2.0, 0.0])


def test_forward_computes_positions_and_velocities(model: mujoco.MjModel, state: Array) -> None:
    data = forward(model, state)
    np.testing.assert_allclose(data.subtree_com[0, 2], 0.35, atol=0.1)
    assert np.abs(data.cvel[1]).max() > 0.5


def test_velocities_are_central_differences(model: mujoco.MjModel) -> None:
    spin, speed = np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, -3.0])
    times_s = np.arange(6) * 0.02
    qpos = np.tile(model.qpos0, (6, 1))
    qpos[:, :3] += times_s[:, None] * speed
    qpos[:, 3:7] = rotations.exp(times_s[:, None] * spin)
    qpos[:, 7:11] = rotations.exp(times_s[:, None] ** 2 * spin)
    found = differentiate(model, qpos, 0.02)
    np.testing.assert_allclose(found[:, :6], np.tile(np.concatenate((speed, spin)), (6, 1)), atol=1e-9)
    # 2 · 2 t within, the mean of the interval at the ends
    np.testing.assert_allclose(found[:, 8], 4 * np.array([0.01, 0.02, 0.04, 0.06, 0.08, 0.09]), atol=1e-9)
