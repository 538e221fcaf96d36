"""The kinematic half of a result, read back, and `simrecon retarget`, which goes on from it."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from simrecon import cli, kinematics, resources, results
from simrecon.errors import InputError
from simrecon.job import Job, Person, request
from simrecon.results import folder as folders
from simrecon.results import kinematic
from tests.support.runs import job_of


@pytest.fixture(scope="module")
def finished(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results") / "squat"
    results.write(job_of(folder), run)
    return folder


@pytest.fixture(scope="module")
def hasty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan that only just simulates."""
    text = (resources.folder("windows") / "quick.toml").read_text(encoding="utf-8")
    for key, value in (("generations", 1), ("descent_steps", 0), ("population", 4), ("evaluations", 60)):
        text = re.sub(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
    path = tmp_path_factory.mktemp("plans") / "hasty.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_fit_is_read_back_on_its_uniform_clock(run: Any, finished: Path) -> None:
    bare, fit = kinematic.read(finished)
    np.testing.assert_array_equal(bare.times_s, run.evidence.times_s)
    np.testing.assert_allclose(fit.times_s, run.fit.times_s, atol=1e-9)
    assert len(fit.times_s) == len(bare.times_s) + 1  # one frame was dropped
    marks = [kinematics.configurations(f.body, f.qpos)[1] for f in (fit, run.fit)]
    known = np.delete(np.arange(10), 4)
    np.testing.assert_allclose(marks[0][known], marks[1][known], atol=1e-5)
    np.testing.assert_allclose(marks[0][4], marks[1][4], atol=0.02)
    assert fit.body.mass_kg == pytest.approx(run.fit.body.mass_kg)
    assert fit.body.height_m == pytest.approx(run.fit.body.height_m)
    assert not fit.interpolated.any()
    np.testing.assert_allclose(fit.com_m[known], run.fit.com_m[known], atol=1e-5)


def test_a_result_without_its_fit_is_refused(tmp_path: Path, run: Any) -> None:
    old = tmp_path / "old"
    alone = replace(run, motion=replace(run.motion, kinematic_qpos=None))
    results.write(job_of(old), alone)
    with pytest.raises(InputError, match="kinematic_qpos: found none"):
        kinematic.read(old)


def test_what_is_written_into_a_result_later_leaves_its_retargeting_repeatable(
    finished: Path, tmp_path: Path
) -> None:
    source = shutil.copytree(finished, tmp_path / "source")
    job = Job(str(source), str(tmp_path / "out"), person=Person(height_m=1.2), retarget=True)
    before = request.contents(job)["input"]
    (source / "motion.trc").write_text("exported", encoding="utf-8")
    report = json.loads((source / "report.json").read_text(encoding="utf-8"))
    report["totals"]["wall_s"] += 1.0
    (source / "report.json").write_text(json.dumps(report), encoding="utf-8")
    assert request.contents(job)["input"] == before
    taken: list[tuple[str, Any]] = [("person", "height_m"), ("frames", "interpolated_frames")]
    for section, key in taken:
        changed = report | {section: report[section] | {key: [1]}}
        (source / "report.json").write_text(json.dumps(changed), encoding="utf-8")
        assert request.contents(job)["input"] != before
    (source / "report.json").write_text(json.dumps(report), encoding="utf-8")
    for name in (folders.MOTION, folders.MODEL):
        kept = (source / name).read_bytes()
        (source / name).write_bytes(kept + b" ")
        assert request.contents(job)["input"] != before
        (source / name).write_bytes(kept)
    assert request.contents(job)["input"] == before


def test_a_result_is_not_retargeted_onto_itself(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (finished / "motion.npz").read_bytes()
    assert cli.main(["retarget", str(finished), "-o", f"{finished}/.", "--height-m", "1.2"]) == 2
    assert "is the result that is retargeted; valid: another folder" in capsys.readouterr().err
    assert (finished / "motion.npz").read_bytes() == before


def test_retarget_simulates_the_motion_on_another_body(finished: Path, hasty: Path, tmp_path: Path) -> None:
    target = tmp_path / "heavy"
    words = ["--mass-distribution", "heavy_head", "--height-m", "1.2", "--plan", str(hasty), "--threads", "1"]
    assert cli.main(["retarget", str(finished), "-o", str(target), *words]) == 0
    model = mujoco.MjModel.from_xml_path(str(target / "model.xml"))
    assert model.body_mass.sum() == pytest.approx(36.5, abs=1e-6)
    assert model.body("head").mass[0] == pytest.approx(0.4 * 36.5, abs=1e-4)
    before, after = results.read_motion(finished), results.read_motion(target)
    np.testing.assert_array_equal(after.times_s, before.times_s)
    pelvis = before.joint_names.index("pelvis")
    ratio = after.joints_m[:, pelvis, 2] / before.joints_m[:, pelvis, 2]
    np.testing.assert_allclose(ratio, 1.2 / 1.75, rtol=0.1)
    said = json.loads((target / "report.json").read_text(encoding="utf-8"))
    assert said["person"]["height_m"] == pytest.approx(1.2)
    assert said["input"]["name"] == str(finished / "motion.npz")
    assert said["input"]["sha256"] == hashlib.sha256((finished / "motion.npz").read_bytes()).hexdigest()
    assert "scaled by 0.6857 to another body" in said["input"]["reading"]
    assert said["audit"]["replay_exact"] is True


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "found no other body; valid: one or more of --height-m"),
        (["--mass-kg", "-3"], "must be a number from"),
        (["--betas", "9"], "--betas: found [9.0]"),
        (["--mass-distribution", "heavy_feet"], "invalid choice: 'heavy_feet'"),
        (["--height-m", "1.5", "--plan", "qick"], "did you mean 'quick'?"),
    ],
)
def test_mistakes_are_one_line(
    finished: Path, tmp_path: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["retarget", str(finished), "-o", str(tmp_path / "out"), *words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert results.read_report(finished)["plan_name"] == "quick"
