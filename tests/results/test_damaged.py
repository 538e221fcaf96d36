"""Results with a damaged report or motion end in one line each."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import results
from simrecon.errors import InputError
from simrecon.job import Job
from simrecon.results import kinematic

REPORTS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "no plan": (lambda report: report.pop("plan"), "found no plan_name and plan"),
    "no mass": (lambda report: report["person"].pop("mass_kg"), "person.*lacks the key 'mass_kg'"),
    "height a word": (lambda report: report["person"].update(height_m="a"), "person.*height_m"),
    "no height": (lambda report: report["person"].update(height_m=None), "person.*lacks the key 'height_m'"),
    "height 0": (lambda report: report["person"].update(height_m=0), "person.*height_m"),
    "betas a word": (lambda report: report["person"].update(betas="x"), "person.*betas"),
    "frames a list": (lambda report: report.update(frames=[]), "frames.*must be a table"),
    "a frame too many": (lambda report: report["frames"].update(interpolated_frames=[999]), "found 999"),
    "an input without name": (lambda report: report["input"].pop("name"), "input.*lacks the key 'name'"),
}


@pytest.fixture
def damaged(run: Any, tmp_path: Path) -> Path:
    results.write(Job("squat.npz", str(tmp_path / "out"), plan=run.problem.plan), run)
    return tmp_path / "out"


@pytest.mark.parametrize("case", REPORTS)
def test_reports(case: str, damaged: Path) -> None:
    damage, message = REPORTS[case]
    path = damaged / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    damage(report)
    path.write_text(json.dumps(report), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        kinematic.read(damaged)


def test_a_report_that_is_no_table(damaged: Path) -> None:
    (damaged / "report.json").write_text("[" * 100_000, encoding="utf-8")
    with pytest.raises(InputError, match="cannot be read"):
        _ = results.open_result(damaged).report
    (damaged / "report.json").write_text("[]", encoding="utf-8")
    with pytest.raises(InputError, match="found no table"):
        _ = results.open_result(damaged).report


def _first_frame(held: dict[str, Any]) -> dict[str, Any]:
    count = len(held["times_s"])
    return {key: value[:1] for key, value in held.items() if value.ndim and len(value) == count}


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda held: held.update(_first_frame(held)), "single frame"),
        (lambda held: held["kinematic_qpos"].__setitem__((slice(None), slice(3, 7)), 0), "unit quaternions"),
        (lambda held: held["qpos"].__setitem__((slice(None), slice(7, 11)), 0.1), "unit quaternions"),
        (lambda held: held.update(state0=held["state0"][:10]), "10 numbers of state"),
        (lambda held: held.update(times_s=1e-9 * held["times_s"]), "a median interval of"),
        (lambda held: held.update(times_s=1e9 * held["times_s"]), "a median interval of"),
        (lambda held: held["contact_body"].__setitem__(0, "\ud800"), r"contact_body: found '\\ud800'"),
    ],
)
def test_motions(damage: Callable[[dict[str, Any]], Any], message: str, damaged: Path) -> None:
    path = damaged / "motion.npz"
    with np.load(path) as file:
        held = {key: file[key] for key in file.files}
    damage(held)
    np.savez_compressed(path, **held)
    with pytest.raises(InputError, match=message):
        _ = results.open_result(damaged).model


def test_a_part_that_the_person_does_not_have(damaged: Path) -> None:
    path = damaged / "motion.npz"
    with np.load(path) as file:
        held = {key: file[key] for key in file.files}
    np.savez_compressed(path, **{**held, "contact_body": ["tail", *held["contact_body"][1:]]})
    with pytest.raises(InputError, match=r"motion\.npz: contact_body: found 'tail'; valid: parts of the"):
        _ = results.open_result(damaged).body
    for key in ("contact_force_N", "contact_point_m", "contact_slip_mps", "contact_probability"):
        held[key] = held[key][:, 1:]
    np.savez_compressed(path, **{**held, "contact_body": held["contact_body"][1:]})
    with pytest.raises(InputError, match=f"contact_body: found no {held['contact_body'][0]}; valid: all"):
        _ = results.open_result(damaged).body


def test_a_motion_without_the_persons_joints(damaged: Path) -> None:
    path = damaged / "motion.npz"
    with np.load(path) as file:
        held = {key: file[key] for key in file.files}
    for key in ("qpos", "kinematic_qpos"):
        held[key] = held[key][:, :7]
    np.savez_compressed(path, **held)
    with pytest.raises(InputError, match=r"motion\.npz: qpos: found 7 coordinates; valid: the person's 71"):
        _ = results.open_result(damaged).body


def test_the_body_has_the_shape_of_the_report(damaged: Path) -> None:
    path = damaged / "report.json"
    report = json.loads(path.read_text(encoding="utf-8"))
    report["person"] |= {"betas": [0.5, -0.25], "shape_space": "simrecon"}
    path.write_text(json.dumps(report), encoding="utf-8")
    body = results.open_result(damaged).body
    assert (body.betas.tolist(), body.shape_space) == ([0.5, -0.25], "simrecon")
