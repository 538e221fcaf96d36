"""A reference that a planner made: what the result and its report keep of it, and its scores."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import replay, results
from simrecon.cli import summary
from simrecon.evaluation import scores
from simrecon.metrics.truth import TRUTH_SCHEMA
from simrecon.results import planned
from tests.support.runs import job_of

LIFT_M = 0.03


@pytest.fixture(scope="module")
def lifted(run: Any) -> Any:
    """The run as if a planner had lifted the person by 3 cm."""
    qpos = run.problem.qpos.copy()
    qpos[:, 2] += LIFT_M
    problem = replace(run.problem, qpos=qpos)
    grid = np.arange(len(run.fit.times_s))[: len(run.motion.times_s)]
    motion, _ = replay.record(problem, run.fit, run.windows, run.fit.times_s[grid], grid)
    return replace(run, motion=motion)


def test_fit_and_plan_are_both_kept(run: Any, lifted: Any, tmp_path: Path) -> None:
    assert run.motion.planned_qpos is None
    results.write(job_of(tmp_path / "r"), lifted)
    motion = results.open_result(tmp_path / "r").motion
    assert motion.planned_qpos is not None
    assert motion.kinematic_qpos is not None
    np.testing.assert_allclose(motion.planned_qpos[:, 2] - motion.kinematic_qpos[:, 2], LIFT_M)
    np.testing.assert_allclose(motion.kinematic_qpos, run.fit.qpos[: len(motion.times_s)])


def test_the_plan_has_a_row_of_scores(lifted: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "r"), lifted)
    motion = lifted.motion
    truth = {"times_s": motion.times_s, "joint_names": motion.joint_names, "joints_m": motion.joints_m}
    np.savez(tmp_path / "truth.npz", schema=TRUTH_SCHEMA, **truth)
    values = scores.score(tmp_path / "r", tmp_path / "truth.npz", seed=None).values
    assert {"result", "kinematic", "plan"} <= set(values)
    assert values["plan"]["mpjpe_mm"] == pytest.approx(values["kinematic"]["mpjpe_mm"])
    assert values["plan"]["e_foot_z_mm"] == pytest.approx(values["kinematic"]["e_foot_z_mm"] + 30, abs=8)
    assert "footskate_gartner_pct" in values["plan"]


def test_the_report_says_what_a_plan_leaves_unexplained(run: Any, tmp_path: Path) -> None:
    """One frame in five asks for a tenth of the weight; the 95th percentile of frames sees it."""
    assert planned.make(run) is None
    body = run.fit.body
    wrench = np.zeros((len(run.fit.times_s), 6))
    wrench[::5, 0] = 0.06 * body.mass_kg * 9.81
    wrench[::5, 2] = 0.08 * body.mass_kg * 9.81
    wrench[:, 4] = 0.02 * body.mass_kg * 9.81 * body.height_m
    run = replace(run, reference=replace(run.reference, root_wrench=wrench))
    results.write(job_of(tmp_path / "r"), run)
    said = json.loads((tmp_path / "r" / "report.json").read_text(encoding="utf-8"))["planned"]
    assert said == {"wrench_force_pct": pytest.approx(10), "wrench_moment_pct": pytest.approx(2)}


def test_the_report_has_planned_forces_and_what_the_planner_says(run: Any, tmp_path: Path) -> None:
    """Two contacts share the weight; in one frame each carries all of it."""
    body, count = run.fit.body, len(run.fit.times_s)
    force = np.zeros((count, 2, 3))
    force[..., 2] = 0.5 * body.mass_kg * 9.81
    force[3] *= 2
    reference = replace(
        run.reference,
        root_wrench=np.zeros((count, 6)),
        contact_force_N=force,
        notes=("breaks forces at 0.10 s",),
    )
    results.write(job_of(tmp_path / "r"), replace(run, reference=reference))
    report = json.loads((tmp_path / "r" / "report.json").read_text(encoding="utf-8"))
    assert report["planned"]["grf_max_pct"] == pytest.approx(200)
    assert report["planned"]["grf_mean_pct"] == pytest.approx(100 * (1 + 1 / count))
    assert report["planner_notes"] == ["breaks forces at 0.10 s"]
    assert "plan     breaks forces at 0.10 s" in summary.of(results.open_result(tmp_path / "r"))
