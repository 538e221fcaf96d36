"""Uniform cubic B-splines: against scipy, and the properties that windows rely on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from simrecon.geometry import splines

spacings = st.floats(0.01, 2.0)
counts = st.integers(4, 40)
phases = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20).map(np.array)


@pytest.mark.parametrize(
    ("count", "spacing_s", "start_s"), [(4, 0.1, 0.0), (9, 0.1, 0.0), (25, 1 / 30, 7 / 30)]
)
def test_same_values_as_scipy(count: int, spacing_s: float, start_s: float) -> None:
    times_s = np.linspace(start_s, start_s + (count - 3) * spacing_s, 101)
    reference = BSpline(start_s + (np.arange(count + 4) - 3.0) * spacing_s, np.eye(count), 3)
    np.testing.assert_allclose(
        splines.basis(times_s, spacing_s, count, start_s), reference(times_s), atol=1e-12
    )


@given(spacings, counts, phases, st.integers(0, 1000))
def test_rows_are_convex_weights(spacing_s: float, count: int, phase: np.ndarray, first: int) -> None:
    start_s = first * spacing_s
    values = splines.basis(start_s + phase * (count - 3) * spacing_s, spacing_s, count, start_s)
    assert values.shape == (phase.size, count)
    assert (values >= 0).all()
    np.testing.assert_allclose(values.sum(axis=1), 1.0, atol=1e-9)


@given(spacings, counts, phases)
def test_each_knot_acts_within_two_spacings_of_its_centre(
    spacing_s: float, count: int, phase: np.ndarray
) -> None:
    times_s = phase * (count - 3) * spacing_s
    values = splines.basis(times_s, spacing_s, count)
    centres_s = splines.knot_times((count - 3) * spacing_s, spacing_s)
    far = np.abs(times_s[:, None] - centres_s) > 2.000001 * spacing_s
    near = np.abs(times_s[:, None] - centres_s) < 1.99 * spacing_s
    assert (values[far] == 0).all()
    assert (values[near] > 0).all()


@given(spacings, counts, phases, st.floats(-5, 5), st.floats(-5, 5))
def test_linear_functions_of_the_centres_are_reproduced(
    spacing_s: float, count: int, phase: np.ndarray, slope: float, offset: float
) -> None:
    times_s = phase * (count - 3) * spacing_s
    knots = offset + slope * splines.knot_times((count - 3) * spacing_s, spacing_s)
    np.testing.assert_allclose(
        splines.basis(times_s, spacing_s, count) @ knots, offset + slope * times_s, atol=1e-8
    )


def test_two_derivatives_are_continuous_and_the_third_is_not() -> None:
    step = 1e-3
    times_s = 2.0 + step * np.arange(-4.0, 5.0)
    knots = np.random.default_rng(0).standard_normal(8)
    values = splines.basis(times_s, 1.0, 8) @ knots
    second = np.diff(values, 2) / step**2
    third = np.diff(second) / step
    assert np.abs(np.diff(second)).max() < 0.1
    assert abs(third[-1] - third[0]) > 0.1


@given(spacings, counts, st.data())
def test_a_window_shares_the_knots_of_the_clip(spacing_s: float, count: int, data: st.DataObject) -> None:
    duration_s = (count - 3) * spacing_s
    low, high = sorted(data.draw(st.tuples(st.floats(0, 1), st.floats(0, 1))))
    times_s = np.linspace(low * duration_s, high * duration_s, 50)
    whole = splines.basis(times_s, spacing_s, count)
    used = splines.support(times_s[0], times_s[-1], spacing_s)
    part = splines.basis(times_s, spacing_s, used.stop - used.start, used.start * spacing_s)
    assert used.stop <= count
    np.testing.assert_allclose(part, whole[:, used], atol=1e-8)
    whole[:, used] = 0
    np.testing.assert_allclose(whole, 0.0, atol=1e-8)


@pytest.mark.parametrize(
    ("first_s", "last_s", "expected"),
    [
        (0.0, 0.0, slice(0, 3)),
        (0.0, 0.1, slice(0, 4)),
        (0.05, 0.06, slice(0, 4)),
        (0.1, 0.3, slice(1, 6)),
        (3 * 0.1, 0.31, slice(3, 7)),
        (0.7 - 1e-15, 0.8 + 1e-15, slice(7, 11)),
    ],
)
def test_support_of_known_intervals(first_s: float, last_s: float, expected: slice) -> None:
    assert splines.support(first_s, last_s, 0.1) == expected


@pytest.mark.parametrize(
    ("duration_s", "expected"),
    [(0.0, 3), (0.05, 4), (0.1, 4), (0.3, 6), (3 * 0.1, 6), (0.31, 7), (60.0, 603)],
)
def test_knot_count_covers_the_duration_and_no_more(duration_s: float, expected: int) -> None:
    assert splines.knot_count(duration_s, 0.1) == expected
    times_s = splines.knot_times(duration_s, 0.1)
    assert times_s.shape == (expected,)
    assert times_s[0] == -0.1
    np.testing.assert_allclose(np.diff(times_s), 0.1, rtol=1e-9)


def test_steps_of_a_long_clip_that_are_off_by_rounding_are_inside() -> None:
    times_s = np.cumsum(np.full(60_000, 0.001))
    count = splines.knot_count(60.0, 0.05)
    assert times_s[-1] != 60.0
    assert splines.basis(times_s[-2:], 0.05, count).shape == (2, count)


@pytest.mark.parametrize("time_s", [-0.01, 0.51, math.nan])
def test_times_outside_are_errors(time_s: float) -> None:
    with pytest.raises(ValueError, match=r"times_s.*valid is \[0, 0\.5\]"):
        splines.basis(np.array([0.2, time_s]), 0.1, 8)


@pytest.mark.parametrize("spacing_s", [0.0, -0.1, math.nan, math.inf])
def test_spacing_must_be_positive(spacing_s: float) -> None:
    with pytest.raises(ValueError, match="spacing_s"):
        splines.knot_count(1.0, spacing_s)
    with pytest.raises(ValueError, match="spacing_s"):
        splines.support(0.0, 1.0, spacing_s)
    with pytest.raises(ValueError, match="spacing_s"):
        splines.basis(np.zeros(1), spacing_s, 5)


@pytest.mark.parametrize(("first_s", "last_s"), [(-0.1, 1.0), (1.0, 0.5), (math.nan, 1.0), (0.0, math.inf)])
def test_intervals_outside_the_grid_are_errors(first_s: float, last_s: float) -> None:
    with pytest.raises(ValueError, match="interval"):
        splines.support(first_s, last_s, 0.1)


def test_other_bad_arguments_are_errors() -> None:
    with pytest.raises(ValueError, match="count: 2"):
        splines.basis(np.zeros(1), 0.1, 2)
    with pytest.raises(ValueError, match="shape"):
        splines.basis(np.zeros((2, 2)), 0.1, 5)
    with pytest.raises(ValueError, match="duration_s"):
        splines.knot_count(-1.0, 0.1)
