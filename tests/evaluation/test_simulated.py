from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import results
from simrecon.errors import InputError
from simrecon.evaluation import simulated
from simrecon.evaluation.geometry import geometry
from simrecon.evidence import Span
from simrecon.metrics.bones import capsule_primitives
from simrecon.replay import SIMULATED
from tests.support.runs import job_of


@pytest.fixture(scope="module")
def written(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scored") / "squat"
    results.write(job_of(folder), run)
    return folder


def test_a_result_is_read_with_its_geometry(written: Path, run: Any) -> None:
    result = simulated.read(written)
    assert result.mass_kg == pytest.approx(run.fit.body.mass_kg)
    assert set(result.radii_m) == set(capsule_primitives())
    np.testing.assert_allclose(result.body.points_m, run.motion.joints_m, atol=1e-5)
    np.testing.assert_allclose(result.body.com_m, run.motion.com_m, atol=1e-5)
    assert result.kinematic is not None
    assert not result.kinematic.com_velocity_mps.any()
    assert result.body.com_velocity_mps.any()


def test_scores_of_the_primitives_are_those_of_the_report(written: Path) -> None:
    result = simulated.read(written)
    motion, report = result.motion, result.report["metrics"]
    values = geometry(result.body, motion.joint_names, motion.times_s, motion.status == SIMULATED).values
    for name, key in (("footskate_gartner_pct", "footskate_pct"), ("float_gartner_pct", "float_pct")):
        assert values[name] == pytest.approx(report[key], rel=1e-12)
    assert values["penetration_max_mm"] == pytest.approx(report["penetration_max_mm"], abs=1e-3)
    assert simulated.reported(result).values["mpjpe_2d_px"] == report["mpjpe_2d_px"]


def test_a_part_of_a_result_is_scored_by_itself(written: Path, run: Any) -> None:
    whole, part = simulated.read(written), simulated.read(written, Span(0.1, 0.25))
    rows = (run.motion.times_s >= 0.1 - 1e-6) & (run.motion.times_s <= 0.25)
    np.testing.assert_array_equal(part.motion.times_s, run.motion.times_s[rows])
    np.testing.assert_allclose(part.body.points_m, whole.body.points_m[rows])
    assert part.kinematic is not None
    np.testing.assert_array_equal(part.motion.frame_step, run.motion.frame_step[rows])
    assert simulated.reported(part).values == {}
    arrays = {name for name, value in vars(run.motion).items() if np.shape(value)[:1] == rows.shape}
    assert arrays == set(simulated.BY_FRAME) - {"planned_qpos"}  # nothing planned


def test_a_report_of_something_else_is_refused(written: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(written, tmp_path / "squat")
    (folder / "report.json").write_text(json.dumps({"metrics": {}}), encoding="utf-8")
    with pytest.raises(InputError, match=r"report.json: "):
        simulated.read(folder)
