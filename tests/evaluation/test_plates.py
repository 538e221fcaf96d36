from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from simrecon.body.primitives import FEET
from simrecon.evaluation import plates
from simrecon.metrics.truth import Plates, Pushes

DT, MASS_KG = 0.01, 60.0
WEIGHT_N = MASS_KG * 9.81


def test_filtered_forces_against_plates() -> None:
    """Ten per cent too much on the left, a hum, and a second in which a plate was missed."""
    times = np.arange(400) * DT
    measured = np.zeros((400, 2, 3))
    measured[..., 2] = 0.5 * WEIGHT_N
    force = measured.copy()
    force[:, 0, 2] += 0.1 * WEIGHT_N + 200 * np.sin(2 * np.pi * 40 * times)
    force[150:250] = 0.0
    known = (times < 1.0) | (times > 3.0)
    values = plates.filtered(force, measured, known, DT, 6.0, MASS_KG).values
    assert values["plate_vertical_mae_pct"] == pytest.approx(10, abs=0.1)
    assert values["plate_left_mae_pct"] == pytest.approx(10, abs=0.1)
    assert values["plate_right_mae_pct"] == pytest.approx(0, abs=0.1)
    assert values["plate_peak_error_pct"] == pytest.approx(10, abs=2)  # the filter begins and ends in the hum
    everywhere = plates.filtered(force, measured, np.ones(400, dtype=bool), DT, 6.0, MASS_KG).values
    assert everywhere["plate_vertical_mae_pct"] > 25


@pytest.mark.parametrize(("rate", "cutoff"), [(100.0, 20.0), (50.0, 20.0), (30.0, 12.0)])
def test_the_filter_is_one_that_the_frame_rate_allows(rate: float, cutoff: float) -> None:
    force = np.full((40, 2, 3), 0.5 * WEIGHT_N)
    values = plates.filtered(force, force, np.ones(40, dtype=bool), 1 / rate, 20.0, MASS_KG).values
    assert values["plate_cutoff_hz"] == pytest.approx(cutoff)
    assert values["plate_vertical_mae_pct"] == pytest.approx(0)


def test_means_since_the_frame_before_lie_in_the_middle() -> None:
    """A force that grows steadily, with a blow in the first frame; centres of pressure only where loaded."""
    times = np.arange(300.0) * DT
    growing = np.zeros((300, 2, 3))
    growing[:, 0, 2] = 300.0 * times
    force = growing.copy()
    force[1:, 0, 2] -= 150.0 * DT
    force[0] = 5000.0
    centre = np.full((300, 2, 3), np.nan)
    centre[:, 0] = [0.2, 0.1, 0.0]
    motion: Any = SimpleNamespace(
        times_s=times,
        grf_N=force.sum(1),
        contact_body=FEET,
        contact_force_N=force,
        contact_point_m=centre,
        is_planned=False,
    )
    clip: Any = SimpleNamespace(times_s=times, interval_s=DT)
    measured = Plates(growing, centre + 0.03, (times > 0.5) & (times < 2.5), 6.0)
    values = plates.against_plates(motion, measured, times, clip, MASS_KG).values
    assert values["plate_vertical_mae_pct"] == pytest.approx(0, abs=0.01)
    assert values["plate_vertical_corr"] == pytest.approx(1)
    assert values["plate_cop_mm"] == pytest.approx(30 * np.sqrt(2))
    assert values["grf_vertical_mae_pct_bw"] > 1


def test_forces_on_a_simulated_reference_are_means_as_well() -> None:
    """Five per cent too little on the right, a hand that helps, and a blow in the first frame."""
    times = np.arange(61) / 30
    names = ("pelvis", *FEET)
    truth = np.zeros((61, 3, 3))
    truth[:, 1:, 2] = 0.5 * WEIGHT_N * (1.0 + 0.5 * np.sin(2 * np.pi * times))[:, None]
    force = truth.copy()
    force[:, 2, 2] -= 0.05 * WEIGHT_N
    force[:, 0, 2] = 0.02 * WEIGHT_N
    force[0] = 9000.0
    motion: Any = SimpleNamespace(
        times_s=times, grf_N=force.sum(1), contact_body=names, contact_force_N=force
    )
    clip: Any = SimpleNamespace(times_s=times, interval_s=1 / 30)
    values = plates.against_pushes(motion, Pushes(names, truth), times, clip, MASS_KG).values
    assert values["grf_vertical_mae_pct_bw"] == pytest.approx(3)
    assert values["grf_corr"] == pytest.approx(1)
    assert values["plate_vertical_mae_pct"] == pytest.approx(5)
    assert values["plate_left_mae_pct"] == pytest.approx(0)
    assert values["plate_right_mae_pct"] == pytest.approx(5)
    assert "plate_cop_mm" not in values
