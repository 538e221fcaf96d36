from __future__ import annotations

import numpy as np
import pytest

from simrecon.metrics import dynamics
from simrecon.metrics.statistics import of_frames
from simrecon.types import Array

DT = 1 / 50
TIMES = np.arange(40) * DT


def thrown() -> Array:
    """(T, 3) centre of mass of a ballistic ball."""
    return np.stack((2.0 * TIMES, -TIMES, 1 + 3 * TIMES - 0.5 * dynamics.GRAVITY_MPS2 * TIMES**2), axis=-1)


def test_a_ballistic_ball_asks_for_no_force_and_a_standing_block_for_its_weight() -> None:
    flying, standing = (
        dynamics.implied_grf(thrown(), 70.0, DT),
        dynamics.implied_grf(np.ones((40, 3)), 70.0, DT),
    )
    np.testing.assert_allclose(flying, 0, atol=1e-9)
    norm = dynamics.grf_norm_pct(flying, 70.0)
    assert dynamics.ballistic_grf_pct(norm, np.ones(38, dtype=bool)) == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(dynamics.grf_norm_pct(standing, 70.0), 100)


def test_mean_force_counts_jitter() -> None:
    """Up and down at 2 g: the norm of the mean force would be 100."""
    force = np.tile([0.0, 0.0, 9.81], (10, 1))
    force[::2, 2], force[1::2, 2] = 9.81 - 19.62, 9.81 + 19.62
    assert dynamics.grf_norm_pct(force, 1.0).mean() == pytest.approx(200)
    np.testing.assert_allclose(dynamics.grf_norm_pct(np.abs(force[1::2]), 1.0), 300)


def test_means_over_other_intervals_keep_the_impulse(rng: np.random.Generator) -> None:
    ends = np.arange(61) / 60
    force = rng.normal(size=(61, 3))
    slow = dynamics.interval_means(ends, force, ends[::2])
    np.testing.assert_allclose(slow, 0.5 * (force[1::2] + force[2::2]))
    odd = np.linspace(0.0, 1.0, 26)
    np.testing.assert_allclose(dynamics.interval_means(ends, force, odd).sum(0) / 25, force[1:].mean(0))
    spike = np.zeros((61, 2))
    spike[30] = 600.0
    assert dynamics.interval_means(ends, spike, ends[::2]).max() == pytest.approx(300)


def test_implied_force_does_not_depend_on_the_mass_place_or_heading(rng: np.random.Generator) -> None:
    com = rng.normal(size=(20, 3))
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    force = dynamics.implied_grf(com, 50.0, DT)
    other = dynamics.implied_grf(com @ turn.T + 4.0, 80.0, DT)
    np.testing.assert_allclose(dynamics.grf_norm_pct(other, 80.0), dynamics.grf_norm_pct(force, 50.0))


def test_ballistic_force_is_a_median_in_flight_only() -> None:
    force = np.zeros((5, 3))
    force[:, 2] = [700.0, 0.0, 9.81, 98.1, 0.0]
    flight = np.array([False, True, True, True, False])
    norm = dynamics.grf_norm_pct(force, 10.0)
    assert dynamics.ballistic_grf_pct(norm, flight) == pytest.approx(10.0)
    assert np.isnan(dynamics.ballistic_grf_pct(norm, np.zeros(5, dtype=bool)))


def test_errors_against_plates(rng: np.random.Generator) -> None:
    """Mean absolute and root mean squared errors of components, percent of body weight."""
    measured = rng.normal(size=(30, 3)) * 100
    force = measured + np.array([0.0, 9.81, -19.62])
    force[3] = np.nan
    error = dynamics.body_weight_pct(force - measured, 10.0)
    for component, value in enumerate((0, 10, 20)):
        column = error[:, component]
        assert of_frames(np.abs(column)).value == pytest.approx(value, abs=1e-12)
        assert of_frames(np.square(column), root=True).value == pytest.approx(value, abs=1e-12)


def test_correlation_of_what_is_known(rng: np.random.Generator) -> None:
    vertical = rng.normal(size=30)
    vertical[3] = np.nan
    assert dynamics.correlation(vertical, 3 * vertical + 1) == pytest.approx(1)
    assert dynamics.correlation(vertical, -vertical) == pytest.approx(-1)
    assert np.isnan(dynamics.correlation(np.ones(5), np.arange(5.0)))


def test_centre_of_pressure_counts_where_both_are_loaded() -> None:
    centre, measured = np.zeros((3, 1, 3)), np.zeros((3, 1, 3))
    measured[..., :2] = [0.03, 0.04]
    measured[..., 2] = 9.0
    load = np.array([[100.0], [100.0], [5.0]])
    assert dynamics.centre_of_pressure_error(centre, measured, load, load) == pytest.approx(0.05)
    assert np.isnan(dynamics.centre_of_pressure_error(centre, measured, 0 * load, load))


def test_peaks_of_torque_and_power() -> None:
    torque, rate = np.zeros((2, 6)), np.zeros((2, 6))
    torque[1, 3:] = [30.0, 0.0, 40.0]
    rate[1, 3:] = [2.0, 5.0, -4.0]
    np.testing.assert_allclose(dynamics.joint_power(torque, rate), [[0, 0], [0, -100]])
    assert dynamics.peak_torque(torque, 50.0) == pytest.approx(1.0)
    assert dynamics.peak_power(torque, rate, 50.0) == pytest.approx(2.0)


def test_residual_is_what_contact_does_not_explain() -> None:
    velocity = np.zeros((5, 3))
    velocity[:, 0] = 0.3 * TIMES[:5]
    force = np.tile([60.0 * 0.3, 0.0, 60.0 * dynamics.GRAVITY_MPS2], (5, 1))
    np.testing.assert_allclose(dynamics.residual_pct(velocity, force, 60.0, DT), 0, atol=1e-9)
    np.testing.assert_allclose(
        dynamics.residual_pct(velocity, 0.9 * force, 60.0, np.full(4, DT)), 10, rtol=1e-3
    )
