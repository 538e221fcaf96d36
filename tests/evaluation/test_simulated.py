from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from simrecon.evaluation import simulated
from simrecon.metrics import bodies
from simrecon.metrics.truth import Plates
from simrecon.types import Scene

DT, MASS_KG = 0.01, 60.0
WEIGHT_N = MASS_KG * 9.81


def test_soles_of_someone_who_stands(standing: Any) -> None:
    model, body, qpos = standing.problem.model, standing.fit.body, standing.fit.qpos[:2].copy()
    parts = tuple(primitive.name for primitive in body.primitives)
    found = bodies.configurations(model, Scene(), qpos, parts, body.skeleton.point_names)
    np.testing.assert_allclose(found.soles_m, 0, atol=1e-6)
    np.testing.assert_allclose(found.feet_m, 0, atol=1e-6)
    qpos[:, 2] += 0.1
    raised = bodies.configurations(model, Scene(), qpos, parts, body.skeleton.point_names)
    np.testing.assert_allclose(raised.soles_m, 0.1, atol=1e-6)
    np.testing.assert_allclose(raised.corners_m - found.corners_m, [[[0, 0, 0.1]] * 8] * 2, atol=1e-6)
    assert {"left_heel", "right_toe"} <= set(simulated.foot_rest(model))
    heels = found.points_m[0, [body.skeleton.point_names.index(f"{side}_heel") for side in ("left", "right")]]
    rest = [simulated.foot_rest(model)[f"{side}_heel"] for side in ("left", "right")]
    np.testing.assert_allclose(heels[:, 2], rest, atol=1e-6)


def test_filtered_forces_against_plates() -> None:
    """Ten per cent too much on the left, a hum, and a second in which a plate was missed."""
    times = np.arange(400) * DT
    measured = np.zeros((400, 2, 3))
    measured[..., 2] = 0.5 * WEIGHT_N
    force = measured.copy()
    force[:, 0, 2] += 0.1 * WEIGHT_N + 200 * np.sin(2 * np.pi * 40 * times)
    force[150:250] = 0.0
    known = (times < 1.0) | (times > 3.0)
    found = simulated.filtered(force, measured, known, DT, 6.0, MASS_KG).values
    assert found["plate_vertical_mae_pct"] == pytest.approx(10, abs=0.1)
    assert found["plate_left_mae_pct"] == pytest.approx(10, abs=0.1)
    assert found["plate_right_mae_pct"] == pytest.approx(0, abs=0.1)
    assert found["plate_peak_error_pct"] == pytest.approx(10, abs=2)  # the filter begins and ends in the hum
    everywhere = simulated.filtered(force, measured, np.ones(400, dtype=bool), DT, 6.0, MASS_KG).values
    assert everywhere["plate_vertical_mae_pct"] > 25


def test_means_since_the_frame_before_lie_in_the_middle() -> None:
    """A force that grows steadily, with a blow in the first frame; centres of pressure only where loaded."""
    times = np.arange(300) * DT
    growing = np.zeros((300, 2, 3))
    growing[:, 0, 2] = 300.0 * times
    force = growing.copy()
    force[1:, 0, 2] -= 150.0 * DT
    force[0] = 5000.0
    centre = np.full((300, 2, 3), np.nan)
    centre[:, 0] = [0.2, 0.1, 0.0]
    motion = SimpleNamespace(
        times_s=times,
        grf_N=force.sum(1),
        contact_body=bodies.FEET,
        contact_force_N=force,
        contact_point_m=centre,
    )
    clip: Any = SimpleNamespace(times_s=times, interval_s=DT)
    plates = Plates(growing, centre + 0.03, (times > 0.5) & (times < 2.5), 6.0)
    of: Any = SimpleNamespace(motion=motion)
    found = simulated.against_plates(of, plates, times, clip, MASS_KG).values
    assert found["plate_vertical_mae_pct"] == pytest.approx(0, abs=0.01)
    assert found["plate_vertical_corr"] == pytest.approx(1)
    assert found["plate_cop_mm"] == pytest.approx(30 * np.sqrt(2))
    assert found["grf_vertical_mae_pct_bw"] > 1
