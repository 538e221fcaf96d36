"""A reference that a planner made: what the result and its report keep of it, and its scores."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import exports, replay, results
from simrecon.cli import summary
from simrecon.errors import InputError
from simrecon.evaluation import scores
from simrecon.exports import forces
from simrecon.metrics.truth import TRUTH_SCHEMA
from simrecon.results import motion_file, planned, recall
from simrecon.types import Motion
from simrecon.viewer import tables
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


def _scored(motion: Motion, folder: Path) -> dict[str, dict[str, float]]:
    """Scores of the result in `folder / "r"` against a motion."""
    truth: dict[str, Any] = {"times_s": motion.times_s, "joint_names": motion.joint_names}
    np.savez(folder / "truth.npz", schema=TRUTH_SCHEMA, joints_m=motion.joints_m, **truth)
    return scores.score(folder / "r", folder / "truth.npz", seed=None).values


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
    values = _scored(lifted.motion, tmp_path)
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
    wrenches = {"wrench_force_pct": pytest.approx(10), "wrench_moment_pct": pytest.approx(2)}
    assert said == wrenches | {"distant_force_pct": None}
    apart = np.tile([0.01, 0.05, 0.3], (len(wrench), 1))
    force = np.zeros((len(wrench), 3, 3))
    force[:, :, 2] = np.array([0.9, 0.06, 0.04]) * body.mass_kg * 9.81
    run = replace(run, reference=replace(run.reference, contact_force_N=force, contact_apart_m=apart))
    made: dict[str, Any] = planned.make(run) or {}
    assert made["distant_force_pct"] == pytest.approx(10)


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


@pytest.fixture(scope="module")
def unsimulated(run: Any) -> Any:
    """The plan of the run, lifted by 3 cm, with half of the weight on each foot, and nothing simulated."""
    qpos = run.problem.qpos.copy()
    qpos[:, 2] += LIFT_M
    problem = replace(run.problem, qpos=qpos)
    frames, weight = len(qpos), run.fit.body.mass_kg * 9.81
    force = np.zeros((frames, 2, 3))
    force[:, :, 2] = weight / 2
    wrench = np.zeros((frames, 6))
    wrench[:, 2] = 0.05 * weight
    reference = replace(
        run.reference,
        planner="soft_contact",
        contact_segments=("left_ankle", "right_ankle"),
        contact_parts=("left_foot", "right_foot"),
        contact_force_N=force,
        contact_place_m=np.zeros((frames, 2, 3)),
        root_wrench=wrench,
    )
    grid = np.arange(len(run.motion.times_s))
    motion, audit = replay.plan(problem, run.fit, reference, run.fit.times_s[grid], grid)
    return replace(run, problem=problem, reference=reference, windows=(), motion=motion, audit=audit)


def test_a_plan_alone_is_no_fallback_and_no_simulation(unsimulated: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "r", engine="none"), unsimulated)
    opened = results.open_result(tmp_path / "r")
    said, count = opened.report, len(unsimulated.motion.times_s)
    assert opened.motion.is_planned
    assert said["engine"] == "none"
    assert said["gaps"] == []
    assert {name: said["frames"][name] for name in ("simulated", "planned", "fallback")} == {
        "simulated": 0,
        "planned": count,
        "fallback": 0,
    }
    assert said["audit"]["replay_exact"] is None
    assert said["agreement"]["fit_mean_m"] == pytest.approx(LIFT_M)
    assert said["planned"]["wrench_force_pct"] == pytest.approx(5)
    (reason,) = [one for one in said["verdict"]["reasons"] if "unexplained" in one["reason"]]
    assert reason["verdict"] == "doubtful"
    assert not [one for one in said["verdict"]["reasons"] if "not simulated" in one["reason"]]
    words = summary.of(opened)
    assert f"{count} of {count} planned, nothing was simulated" in words
    assert "5.0 % of body weight and 0.0 % of body weight times stature are unexplained" in words
    assert "fallback" not in words


def test_the_page_of_a_plan_says_that_nothing_was_simulated(unsimulated: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "r", engine="none"), unsimulated)
    rows = {
        name: words
        for table in tables.make(results.open_result(tmp_path / "r").report)
        for name, words, *_ in table["rows"]
    }
    assert rows["Replay"] == "none: nothing was simulated"
    assert "nothing was simulated" in rows["Frames planned"]
    assert rows["Force that the plan leaves unexplained, of body weight"] == "5.0 %"


def test_a_plan_is_scored_with_its_forces(unsimulated: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "r", engine="none"), unsimulated)
    values = _scored(unsimulated.motion, tmp_path)
    assert values["result"]["mpjpe_g_mm"] == pytest.approx(0, abs=1e-6)
    assert values["result"]["mpjpe_g_mm"] == values["plan"]["mpjpe_g_mm"]
    assert values["kinematic"]["mpjpe_g_mm"] == pytest.approx(1e3 * LIFT_M)
    assert values["result"]["grf_vertical_mean_pct"] == pytest.approx(100)


def test_without_forces_none_are_scored(unsimulated: Any, tmp_path: Path) -> None:
    bare = replace(unsimulated.reference, contact_force_N=None, root_wrench=None)
    grid = np.arange(len(unsimulated.motion.times_s))
    motion, _ = replay.plan(unsimulated.problem, unsimulated.fit, bare, unsimulated.motion.times_s, grid)
    results.write(job_of(tmp_path / "r", engine="none"), replace(unsimulated, motion=motion, reference=bare))
    values = _scored(motion, tmp_path)["result"]
    assert not [name for name in values if name.startswith(("grf", "peak_torque", "contact_f1_force"))]
    opened = results.open_result(tmp_path / "r")
    assert opened.report["metrics"]["mean_grf_pct_bw"] is None
    assert "none: this planner knows no forces" in summary.of(opened)
    files = {path.name for path in exports.export(opened, ["csv", "c3d"], tmp_path / "e")}
    assert files == {"motion.csv", "motion.c3d"}
    with pytest.raises(InputError, match="a plan without forces"):
        exports.export(opened, ["mot"], tmp_path / "e")


def test_exported_forces_of_a_plan_keep_their_impulse(unsimulated: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "r", engine="none"), unsimulated)
    found = forces.steps(results.open_result(tmp_path / "r"))
    weight = unsimulated.fit.body.mass_kg * 9.81
    seconds = found.times_s[-1] - found.times_s[0]
    assert found.sums[-1, :, 2].sum() == pytest.approx(weight * seconds)
    loads = found.at(unsimulated.motion.times_s[3:4], 1 / 30)
    assert loads.force_N[0, found.segments.index("left_ankle"), 2] == pytest.approx(weight / 2)
    names = {
        path.name for path in exports.export(tmp_path / "r", ["mot", "csv", "c3d", "glb"], tmp_path / "e")
    }
    assert {"forces.mot", "forces.csv", "motion.c3d"} <= names


def test_a_plan_does_not_replace_a_simulation(run: Any, unsimulated: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "r"), run)
    again = results.write(job_of(tmp_path / "r", engine="none"), unsimulated)
    assert again.folder.name == "r-2"
    assert results.write(job_of(tmp_path / "r-2"), run).folder.name == "r-2"


def test_a_rerun_of_a_plan_begins_with_the_fit(unsimulated: Any, tmp_path: Path) -> None:
    results.write(job_of(tmp_path / "r", engine="none"), unsimulated)
    assert recall.job_of(results.open_result(tmp_path / "r")).start is None


def test_one_planned_frame_among_others_is_refused(unsimulated: Any, tmp_path: Path) -> None:
    status = unsimulated.motion.status.copy()
    status[2] = replay.FALLBACK
    (tmp_path / "motion.npz").write_bytes(motion_file.dumps(replace(unsimulated.motion, status=status)))
    with pytest.raises(InputError, match="status: found 2 at some frames; valid: 2 at all frames or at none"):
        motion_file.read(tmp_path / "motion.npz")
