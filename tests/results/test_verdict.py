"""Whether a result can be believed, from its report."""

from __future__ import annotations

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, resources, results
from simrecon import plan as plans
from simrecon.evidence.camera import fov
from simrecon.job import Job, Reading
from simrecon.results import assumed, ranking, verdict
from simrecon.running import run as run_job
from tests.support.runs import job_of

CLEAN: dict[str, Any] = {
    "plan_name": "quick",
    "input": {"sha256": "0" * 64},
    "person": {"height_m": 1.7, "mass_kg": 64.0},
    "assumed": {
        "height": {"origin": "estimated", "shown_m": 1.62},
        "mass": {"origin": "estimated"},
        "lens": {"origin": "given", "by": "--fov", "fov_deg": 40.0, "size_px": [1080, 1920]},
        "camera": {"origin": "estimated", "height_m": 1.5, "down_deg": 3.0},
        "floor": {"origin": "estimated", "height_m": 0.0},
    },
    "agreement": {
        "image_px": 9.0, "image_person_pct": 1.1, "image_height_pct": 0.5, "person_px": 820.0,
        "fit_mean_m": 0.02, "fit_max_m": 0.06, "fit_max_s": 1.2, "input_mean_m": None, "fell": False,
        "bone": None, "bone_pct": None,
    },
    "kinematics": {"reprojection_median_px": 4.0},
    "frames": {"count": 179, "simulated": 179, "fallback": 0, "interpolated": 0},
    "gaps": [],
    "metrics": {"penetration_max_mm": 12.0},
}  # fmt: skip
FELL = [
    {"from_s": 1.2, "to_s": 2.9, "frames": 9, "reason": "fell", "detail": "no balance", "plan": "default"}
]


def changed(**sections: Any) -> dict[str, Any]:
    """The clean report with some values of some sections changed."""
    report = copy.deepcopy(CLEAN)
    for name, values in sections.items():
        old = report[name]
        report[name] = {**old, **values} if isinstance(old, dict) and isinstance(values, dict) else values
    return {**report, "verdict": verdict.judge(report)}


def test_a_clean_result_is_good() -> None:
    assert changed()["verdict"] == {"verdict": "good", "reasons": []}


@pytest.mark.parametrize(
    ("sections", "level", "words"),
    [
        ({"frames": {"points_seen": 1.0}}, "bad", "only 1 point of the person can be seen"),
        ({"frames": {"points_seen": 5.0}}, "doubtful", "only 5 points of the person can be seen"),
        ({"agreement": {"image_px": 30.0, "image_person_pct": 3.7}}, "doubtful", "3.7 % of the person's"),
        ({"agreement": {"image_px": 50.0, "image_person_pct": 6.1}}, "bad", "6.1 % of the person's"),
        ({"agreement": {"image_px": 110.0, "image_height_pct": 5.7}}, "bad", "5.7 % of the image's"),
        ({"agreement": {"fit_mean_m": 0.06}}, "doubtful", "6 cm beside the kinematic fit"),
        ({"agreement": {"fit_mean_m": 0.11}}, "bad", "11 cm beside the kinematic fit"),
        ({"agreement": {"fit_max_m": 0.38}}, "bad", "38 cm at 1.20 s"),
        ({"agreement": {"fell": True}}, "bad", "fell"),
        ({"agreement": {"input_mean_m": 0.05}}, "doubtful", "5 cm beside the joints of the motion capture"),
        ({"agreement": {"bone": "hip_width", "bone_pct": -18.2}}, "doubtful", "hip width is 18 % shorter"),
        ({"assumed": {"lens": {**CLEAN["assumed"]["lens"], "fov_deg": 65.0}}}, "doubtful", "37 to 43°"),
        (
            {"frames": {"fallback": 3, "simulated": 176}, "gaps": FELL},
            "doubtful",
            "3 frames of 179 are not",
        ),
        ({"frames": {"fallback": 1, "simulated": 178}, "gaps": FELL}, "doubtful", "1 frame of 179 is not"),
        ({"frames": {"fallback": 103, "simulated": 76}, "gaps": FELL}, "bad", "from 1.20 to 2.90 s (fell"),
        ({"frames": {"interpolated": 60}}, "doubtful", "out of view in 34 %"),
        ({"person": {"height_m": 1.36}}, "doubtful", "1.36 m was estimated"),
        ({"metrics": {"penetration_max_mm": 80.0}}, "doubtful", "80 mm under the floor"),
    ],
)
def test_each_reason_is_said_with_what_to_do(sections: dict[str, Any], level: str, words: str) -> None:
    found = changed(**sections)["verdict"]
    assert found["verdict"] == level
    (reason,) = found["reasons"]
    assert words in reason["reason"]
    assert reason["advice"]


def test_a_stature_that_was_given_is_nobody_s_doubt() -> None:
    given = {**CLEAN["assumed"], "height": {"origin": "given", "shown_m": None}}
    assert changed(person={"height_m": 1.2}, assumed=given)["verdict"]["verdict"] == "good"


def test_the_worst_reason_comes_first() -> None:
    found = changed(person={"height_m": 1.3}, agreement={"fit_mean_m": 0.2})["verdict"]
    assert [reason["verdict"] for reason in found["reasons"]] == ["bad", "doubtful"]


def test_a_worse_result_is_one_with_a_worse_verdict_or_fewer_frames() -> None:
    good, doubtful = changed(), changed(agreement={"fit_mean_m": 0.06})
    fell = changed(frames={"fallback": 103, "simulated": 76}, gaps=FELL)
    assert ranking.is_worse(doubtful, good)
    assert ranking.is_worse(fell, doubtful)
    assert not ranking.is_worse(good, fell)
    assert not ranking.is_worse(good, good)
    blurred = changed(agreement={"fit_mean_m": 0.04})
    assert ranking.is_worse(blurred, good)
    assert not ranking.is_worse({**blurred, "input": {"sha256": "1" * 64}}, good)


def test_a_result_of_an_earlier_version_is_compared_by_its_frames() -> None:
    old = {key: value for key, value in changed().items() if key not in ("verdict", "agreement", "gaps")}
    fell = changed(frames={"fallback": 103, "simulated": 76}, gaps=FELL)
    assert ranking.is_worse(fell, old)
    assert not ranking.is_worse(changed(agreement={"fit_mean_m": 0.3}), old)


# --- in a result


def test_a_report_says_what_was_assumed(run: Any, tmp_path: Path) -> None:
    said = results.write(job_of(tmp_path / "out"), run).report
    assert said["assumed"]["height"]["origin"] == said["assumed"]["mass"]["origin"] == "given"
    assert said["assumed"]["lens"]["size_px"] == [640, 480]
    assert said["assumed"]["lens"]["fov_deg"] == pytest.approx(2 * np.degrees(np.arctan(320 / 600)))
    assert said["assumed"]["camera"] == {
        "origin": "given", "height_m": pytest.approx(1.0), "down_deg": pytest.approx(0.0),
    }  # fmt: skip
    assert said["assumed"]["floor"] == {"origin": "given", "height_m": 0.0}
    assert said["gaps"] == []
    assert said["agreement"]["person_px"] == pytest.approx(600 * 1.75 / 4, rel=0.02)
    assert said["agreement"]["image_px"] == pytest.approx(said["metrics"]["mpjpe_2d_px"], rel=0.01)
    assert 0 < said["agreement"]["fit_mean_m"] <= said["agreement"]["fit_max_m"] < 0.1


def test_what_nobody_says_of_the_person_is_estimated(run: Any, tmp_path: Path) -> None:
    unknown = replace(run, evidence=replace(run.evidence, height_m=None, mass_kg=None))
    said = assumed.make(job_of(tmp_path), unknown)
    assert (said["height"]["origin"], said["mass"]["origin"]) == ("estimated", "estimated")
    assert said["height"]["shown_m"] == pytest.approx(1.75, rel=0.05)


def test_a_worse_result_is_put_beside_a_better_one(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    results.write(job_of(out), run)
    before = (out / "motion.npz").read_bytes()
    moved = replace(run, motion=replace(run.motion, joints_m=run.motion.joints_m + 1.0))
    for number in (2, 3):
        second = results.write(job_of(out), moved)
        assert second.folder == tmp_path / f"out-{number}"
        assert second.report["better"] == str(out)
        assert second.job.output == str(tmp_path / f"out-{number}")
    assert (out / "motion.npz").read_bytes() == before
    third = results.write(job_of(out), moved, overwrite=True)
    assert third.folder == out
    assert "better" not in third.report
    assert results.write(job_of(out), run).folder == out  # a better one always replaces


def test_an_earlier_report_that_makes_no_sense_is_replaced(run: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    results.write(job_of(out), run)
    (out / "report.json").write_text(json.dumps({"schema": "simrecon.result/1"}), encoding="utf-8")
    assert results.write(job_of(out), run).folder == out


@pytest.mark.slow
def test_a_phone_video_with_the_lens_of_the_other_side_is_not_good(tmp_path: Path) -> None:
    seen = evidence.read(resources.folder("example") / "beam.npz")
    assert seen.camera is not None
    lens = fov.from_fov(65.0, seen.camera.lens.image_size_px)
    evidence.write(tmp_path / "clip.npz", replace(seen, camera=lens))
    clip = str(tmp_path / "clip.npz")
    job = Job(clip, str(tmp_path / "out"), Reading(fov_deg=65.0), detected=clip)
    report = run_job(replace(job, plan=plans.read("quick"))).report
    assert report["verdict"]["verdict"] in ("doubtful", "bad")
    assert any("37 to 43°" in reason["reason"] for reason in report["verdict"]["reasons"])


@pytest.mark.parametrize(
    ("force", "moment", "distant", "level"),
    [
        (0.5, 0.7, None, "good"),
        (3.5, 0.1, 1.0, "doubtful"),
        (0.1, 10.5, 1.0, "bad"),
        (0.1, 0.1, 40.0, "doubtful"),
    ],
)
def test_a_plan_is_judged_by_what_it_leaves_unexplained(
    force: float, moment: float, distant: float | None, level: str
) -> None:
    report = copy.deepcopy(CLEAN)
    report["planned"] = {
        "wrench_force_pct": force,
        "wrench_moment_pct": moment,
        "distant_force_pct": distant,
    }
    assert verdict.judge(report)["verdict"] == "good"  # a simulation has nothing of it
    report["frames"] |= {"simulated": 0, "planned": 179}
    assert verdict.judge(report)["verdict"] == level
