from __future__ import annotations

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.metrics import rates


def test_values_at_other_times_lie_on_the_line_and_are_held_beyond_the_ends() -> None:
    times = np.array([0.0, 0.5, 2.0])
    values = np.stack((3.0 * times, 1.0 - times), axis=-1)
    other = np.array([-1.0, 0.25, 1.1, 3.0])
    inside = np.clip(other, 0.0, 2.0)
    np.testing.assert_allclose(
        rates.at(other, times, values), np.stack((3.0 * inside, 1.0 - inside), axis=-1), atol=1e-12
    )


def test_resampled_spans_the_same_time_at_the_other_rate() -> None:
    times = np.arange(51) / 50
    np.testing.assert_allclose(rates.every(times, 25.0), np.arange(26) / 25)
    np.testing.assert_allclose(rates.resampled(times, times**2, 25.0), (np.arange(26) / 25) ** 2, atol=1e-12)
    assert len(rates.every(times[:2], 25.0)) == 3


def test_covered_times_are_those_of_the_reference_within_the_motion() -> None:
    truth = np.arange(11) / 10
    np.testing.assert_array_equal(rates.covered_times(np.array([0.3, 0.8 - 1e-9]), truth), truth[3:9])
    with pytest.raises(InputError, match=r"found 2 frames of the reference from 0.300 to 0.400 s"):
        rates.covered_times(np.array([0.3, 0.4]), truth)
