"""`--engine none` from the command line: exit statuses, and what the commands after it make of a plan."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import cli, evidence, replay, resources, results
from simrecon.metrics.truth import TRUTH_SCHEMA


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fifth of a second of the demo."""
    given = evidence.read(resources.folder("example") / "beam.npz")
    path = tmp_path_factory.mktemp("clip") / "clip.npz"
    evidence.write(path, evidence.cut(given, slice(0, 12)))
    return path


@pytest.fixture(scope="module")
def planned(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan, its exit status 0: all frames are as they were asked for."""
    target = tmp_path_factory.mktemp("out") / "plan"
    words = ["--engine", "none", "--planner", "soft_contact", "--plan", "quick", "--no-report"]
    assert cli.main(["run", str(clip), "-o", str(target), *words]) == 0
    return target


def test_a_plan_is_a_result_of_its_own(planned: Path) -> None:
    opened = results.open_result(planned)
    assert (opened.motion.status == replay.PLANNED).all()
    assert opened.motion.knows_forces
    assert opened.report["audit"]["replay_exact"] is None
    assert opened.report["windows"] == []
    assert opened.report["planned"]["distant_force_pct"] >= 0


def test_its_motion_is_exported_and_said_to_be_a_plan(
    planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["export", str(planned), "--to", "bvh,mot", "-o", str(tmp_path)]) == 0
    assert "nothing is simulated: the motion is the plan" in capsys.readouterr().err


def test_its_scores_are_said_to_be_those_of_a_plan(
    planned: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motion = results.read_motion(planned)
    truth: dict[str, Any] = {"times_s": motion.times_s, "joint_names": motion.joint_names}
    np.savez(tmp_path / "truth.npz", schema=TRUTH_SCHEMA, joints_m=motion.joints_m, **truth)
    assert cli.main(["eval", str(planned), str(tmp_path / "truth.npz")]) == 0
    said = capsys.readouterr()
    assert "result is a plan: nothing was simulated" in said.err
    assert "kinematic" in said.out


def test_a_rerun_simulates_it(planned: Path, tmp_path: Path) -> None:
    target = tmp_path / "simulated"
    words = ["--engine", "sampling", "--planner", "none", "--threads", "1"]
    assert cli.main(["rerun", str(planned), "-o", str(target), *words]) == 0
    report = json.loads((target / "report.json").read_text(encoding="utf-8"))
    assert report["frames"]["simulated"] == report["frames"]["count"]
    assert report["audit"]["replay_exact"] is True


def test_it_is_put_on_another_body_and_planned_there(planned: Path, tmp_path: Path) -> None:
    target = tmp_path / "taller"
    words = ["--height-m", "1.9", "--engine", "none", "--planner", "soft_contact", "--no-report"]
    assert cli.main(["retarget", str(planned), "-o", str(target), *words]) == 0
    assert results.open_result(target).report["person"]["height_m"] == pytest.approx(1.9)


def test_a_floor_that_simulations_find_is_refused(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "soft.toml"
    scene.write_text('[ground]\nstiffness_Npm = "fit"\n', encoding="utf-8")
    words = ["--engine", "none", "--scene", str(scene)]
    assert cli.main(["run", str(clip), "-o", str(tmp_path / "out"), *words]) == 2
    assert "which only simulations find; valid: engine sampling" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
