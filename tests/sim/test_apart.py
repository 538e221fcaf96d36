"""Derivatives that processes of their own help with: the same bits, whatever becomes of these."""

from __future__ import annotations

import time

import mujoco
import numpy as np
import pytest

from simrecon.sim import rollout
from simrecon.sim.apart import Colleague
from simrecon.sim.derivatives import transitions
from simrecon.sim.inverse import Inverse
from simrecon.sim.models import compile_text
from simrecon.sim.rollout import Simulator
from simrecon.sim.state import initial_state, simulate
from simrecon.types import Array

XML = """
<mujoco>
  <option timestep="0.01" integrator="discrete" jacobian="sparse"/>
  <worldbody>
    <geom type="plane" size="5 5 0.1"/>
    <body name="trunk" pos="0 0 0.12">
      <freejoint/>
      <geom type="capsule" fromto="-0.2 0 0 0.2 0.1 0" size="0.1" mass="5"/>
      <body name="arm" pos="0.3 0 0">
        <joint name="shoulder" type="hinge" axis="0 1 0"/>
        <geom type="box" pos="0.15 0 0" size="0.15 0.04 0.04" mass="1"/>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="shoulder" kp="50" kv="2" forcerange="-20 20"/></actuator>
</mujoco>
"""
STEPS = 12


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return compile_text(XML)


@pytest.fixture
def ctrl(model: mujoco.MjModel, rng: np.random.Generator) -> Array:
    return rng.normal(size=(STEPS, model.nu))


@pytest.fixture
def states(model: mujoco.MjModel, ctrl: Array) -> Array:
    return simulate(model, initial_state(model, model.qpos0, np.zeros(model.nv)), ctrl)


def started(model: mujoco.MjModel, felt: tuple[int, ...] = ()) -> Colleague:
    colleague = Colleague(Inverse(model, felt))
    deadline = time.monotonic() + 60.0
    while not colleague.ready:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return colleague


def test_a_colleague_finds_the_same_bits(model: mujoco.MjModel, states: Array, ctrl: Array) -> None:
    colleague, parts = started(model, (1,)), [slice(0, 5), slice(7, 12)]
    assert colleague.ask(states, ctrl, parts)
    found, inverse = colleague.answer(), Inverse(model, (1,))
    assert sorted(found) == [0, 7]
    for part in parts:
        own = transitions(inverse, states[part.start : part.stop + 1], ctrl[part])
        np.testing.assert_array_equal(found[part.start].state, own.state)
        np.testing.assert_array_equal(found[part.start].control, own.control)
        np.testing.assert_array_equal(found[part.start].wrench, own.wrench)
        assert own.wrench.shape[1] == 6
    colleague.close()


def test_a_simulator_does_what_a_lost_colleague_leaves(
    model: mujoco.MjModel, states: Array, ctrl: Array
) -> None:
    alone, helped = Simulator(model, 2, 1), Simulator(model, 2, 2)
    expected = alone.transitions(states, ctrl)
    assert not alone.colleagues
    helped.colleagues.append(started(model))
    for lost in (False, True):
        if lost:
            helped.colleagues[0].process.kill()
            helped.colleagues[0].process.wait()
        for one, other in zip(helped.transitions(states, ctrl), expected, strict=True):
            np.testing.assert_array_equal(one.state, other.state)
            np.testing.assert_array_equal(one.control, other.control)
    assert not helped.colleagues[0].ready


def test_an_answer_that_nobody_fetched_is_not_taken_for_another(
    model: mujoco.MjModel, states: Array, ctrl: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    helped = Simulator(model, 2, 2)
    helped.colleagues.append(started(model))
    with monkeypatch.context() as patch:
        patch.setattr(rollout, "transitions", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            helped.transitions(states, ctrl)
    other = simulate(model, states[-1], -ctrl)
    expected = Simulator(model, 2, 1).transitions(other, -ctrl)
    for one, own in zip(helped.transitions(other, -ctrl), expected, strict=True):
        np.testing.assert_array_equal(one.state, own.state)
        np.testing.assert_array_equal(one.control, own.control)


def test_a_colleague_ends_with_the_one_who_asks(model: mujoco.MjModel) -> None:
    colleague = started(model)
    process = colleague.process
    del colleague
    assert process.wait(10.0) == 0
