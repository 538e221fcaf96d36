"""First velocities from the momenta of a flight: a known somersault is velocity again under noise."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from simrecon.engines import momentum
from simrecon.geometry import rotations
from simrecon.sim.poses import differentiate
from simrecon.sim.state import initial_state, qpos_of, simulate
from simrecon.types import Array

FRAME_S = 1 / 30


@pytest.fixture(scope="module")
def flown(make: Any) -> tuple[mujoco.MjModel, Array, Array]:
    """Model, frames of a tumbling flight 3 m over the floor, and its first velocity."""
    problem = make.clip(make.settings())
    model = problem.model
    model.opt.timestep = FRAME_S / 20
    qpos, qvel = problem.qpos[0].copy(), np.zeros(model.nv)
    qpos[2] += 3.0
    qvel[:6] = 1.0, -0.5, 2.0, 0.5, 6.0, -0.3
    states = simulate(model, initial_state(model, qpos, qvel), np.tile(problem.targets_rad[0], (240, 1)))
    return model, qpos_of(model, states)[::20], qvel


def noisy(qpos: Array, rng: np.random.Generator) -> Array:
    """Frames with the root off by 1 cm and 0.02 rad each."""
    moved = qpos.copy()
    moved[:, :3] += rng.normal(scale=0.01, size=(len(qpos), 3))
    turns = rotations.exp(rng.normal(scale=0.02, size=(len(qpos), 3)))
    moved[:, 3:7] = rotations.multiply(qpos[:, 3:7], turns)
    return moved


def test_a_flight_is_told_from_a_stance(make: Any, flown: tuple[mujoco.MjModel, Array, Array]) -> None:
    model, qpos, _ = flown
    assert momentum.flight(model, qpos) == len(qpos)
    lower = qpos.copy()
    lower[5:, 2] -= 3.5
    assert momentum.flight(model, lower) == 5
    stance = make.clip(make.settings())
    assert momentum.flight(stance.model, stance.qpos) == 0
    np.testing.assert_array_equal(
        momentum.first_velocity(stance.model, stance.qpos, FRAME_S),
        differentiate(stance.model, stance.qpos[:3], FRAME_S)[0],
    )


def test_the_velocity_of_a_flight_is_velocity_again(flown: tuple[mujoco.MjModel, Array, Array]) -> None:
    model, qpos, truth = flown
    velocity = momentum.first_velocity(model, qpos, FRAME_S)
    np.testing.assert_allclose(velocity[:3], truth[:3], atol=0.03)
    np.testing.assert_allclose(velocity[3:6], truth[3:6], atol=0.15)


def test_noise_does_less_harm_than_to_differences(
    flown: tuple[mujoco.MjModel, Array, Array], rng: np.random.Generator
) -> None:
    model, qpos, truth = flown
    errors = []
    for _ in range(20):
        seen = noisy(qpos, rng)
        differences = differentiate(model, seen[:3], FRAME_S)[0]
        velocity = momentum.first_velocity(model, seen, FRAME_S)
        errors.append(np.abs(np.stack((differences, velocity))[:, :6] - truth[:6]))
    by_differences, by_flight = np.mean(errors, axis=0)  # (6,) each
    assert (by_flight[:3] < by_differences[:3] / 4).all()
    assert (by_flight[3:5] < by_differences[3:5] / 4).all()
    assert by_flight[5] < 1.1 * by_differences[5]  # about the long axis, with little inertia
