from __future__ import annotations

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.metrics import filters


def test_low_pass_is_3_decibels_down_at_its_cutoff_without_lag() -> None:
    times = np.arange(2000) / 100
    for frequency, gain in ((1.0, 1.0), (6.0, np.sqrt(0.5)), (25.0, 0.0)):
        wave = np.sin(2 * np.pi * frequency * times)
        passed = filters.low_pass(wave, 0.01, 6.0)[500:1500]
        scale = passed @ wave[500:1500] / (wave[500:1500] @ wave[500:1500])
        assert scale == pytest.approx(gain, abs=0.01)
        np.testing.assert_allclose(passed, scale * wave[500:1500], atol=0.01)


@pytest.mark.parametrize("cutoff", [0.0, 50.0, -3.0])
def test_low_pass_refuses_what_the_rate_does_not_allow(cutoff: float) -> None:
    with pytest.raises(InputError, match=r"cut-off: found .* below 50 Hz"):
        filters.low_pass(np.zeros(100), 0.01, cutoff)
