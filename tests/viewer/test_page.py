"""The page of a result: what it holds is what the result holds, and a browser shows it without a network."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import simrecon
from simrecon import cli, results, running, viewer
from simrecon.cli import summary
from simrecon.errors import InputError
from simrecon.exports.axes import TO_Y_UP
from simrecon.geometry import camera as cameras
from simrecon.results import Result
from simrecon.viewer import curves, page, quality, seen, stills, tables
from tests.support.runs import job_of

FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader",
    "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--virtual-time-budget=30000",
)  # fmt: skip


@pytest.fixture(scope="module")
def made(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Result:
    result = results.write(job_of(tmp_path_factory.mktemp("results") / "squat <b>"), run)
    viewer.write(result)
    return result


@pytest.fixture(scope="module")
def text(made: Result) -> str:
    return (made.folder / "report.html").read_text(encoding="utf-8")


def told(text: str) -> dict[str, Any]:
    """The JSON that stands in a page."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    content: dict[str, Any] = json.loads(found[1])
    return content


def test_curves_are_those_of_the_result(made: Result, text: str) -> None:
    motion, shown = made.motion, told(text)["curves"]
    np.testing.assert_allclose(shown["times_s"], motion.times_s - motion.times_s[0], atol=1e-4)
    assert shown["status"] == motion.status.tolist()
    np.testing.assert_allclose(shown["com_m"], motion.com_m @ TO_Y_UP.T, atol=1e-4)
    for name, values in shown["feet_N"].items():
        column = motion.contact_force_N[1:, motion.contact_body.index(name), 2]
        np.testing.assert_allclose(values[1:], column, atol=0.51)
    np.testing.assert_allclose(shown["grf_N"][1:], motion.grf_N[1:, 2], atol=0.51)
    assert shown["grf_N"][0] == 0  # of an instant, and no mean
    pushed = np.array(shown["forces"]["force_N"], float)[1:].sum(axis=1)
    np.testing.assert_allclose(pushed, motion.grf_N[1:] @ TO_Y_UP.T, atol=30.0)  # slight touches are left out
    torque = np.array(shown["torques_Nm"], dtype=object)
    assert (torque[:, :, 0] == None).all()  # noqa: E711
    np.testing.assert_allclose(
        torque[:, :, 1:].astype(float),
        np.moveaxis(motion.torque_Nm.reshape(-1, 16, 3), 0, -1)[..., 1:],
        atol=0.051,
    )


def test_bands_are_those_of_the_motion(made: Result, text: str) -> None:
    shown, motion = told(text)["curves"]["bands_N"], made.motion
    assert motion.band_feet_N is not None
    assert motion.band_grf_N is not None
    bands = {
        "left_foot": motion.band_feet_N[:, 0],
        "right_foot": motion.band_feet_N[:, 1],
        "all": motion.band_grf_N,
    }
    for name, band in bands.items():
        own = np.array(shown[name], dtype=object)
        assert (own[:, 0] == None).all()  # noqa: E711  # of an instant
        np.testing.assert_allclose(own[:, 1:].astype(float), band[1:, 2].T, atol=0.51)
    bare = replace(motion, band_grf_N=None)
    result = results.open_result(made.folder)
    result.__dict__["motion"] = bare
    assert curves.make(result, np.arange(len(motion.times_s)))["bands_N"] is None


def test_moments_and_powers_are_those_of_the_result(made: Result, text: str) -> None:
    shown, found = told(text)["curves"], made.moments()
    np.testing.assert_allclose(np.array(shown["moments_Nm"]), np.moveaxis(found.moment_Nm, 0, -1), atol=0.051)
    np.testing.assert_allclose(np.array(shown["powers_W"]), found.power_W.T, atol=0.51)
    assert shown["cutoff_Hz"] == pytest.approx(found.cutoff_hz, abs=0.06)


def test_angles_are_those_of_the_joints(made: Result) -> None:
    """A knee of the squat is bent by what the pose says, about its own axis alone."""
    shown = curves.make(made, np.arange(len(made.motion.times_s)))
    knee = np.array(shown["angles_deg"])[shown["joints"].index("left knee")]
    upright = made.motion.joints_m
    hip, knee_m, ankle = (
        upright[:, made.motion.joint_names.index(f"left_{n}")] for n in ("hip", "knee", "ankle")
    )
    a, b = knee_m - hip, ankle - knee_m
    cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
    np.testing.assert_allclose(np.linalg.norm(knee, axis=0), np.degrees(np.arccos(cosine)), atol=6.0)


def test_the_page_needs_nothing_else_and_escapes_what_it_shows(text: str) -> None:
    assert "<b>" not in text.split("<script>")[0].replace('id="', "")
    assert "squat &lt;b&gt;" in text
    assert not re.search(r"<(script|link|img|video)[^>]*\s(src|href)=", text)
    assert "default-src 'none'" in text
    assert text.count("</script>") == text.count("<script")
    assert "Permission is hereby granted" in text  # the licence of three.js
    assert len(text) < 5e6


def test_what_stands_in_a_script_cannot_end_it() -> None:
    wicked = {"name": "</script><script>alert(1)</script><!-- & \u2028"}
    inside = page.embedded(wicked)
    assert not set("<>&\u2028") & set(inside)
    assert json.loads(inside) == wicked


def test_a_long_motion_is_thinned_out() -> None:
    assert page.frames(1500).tolist() == list(range(1500))
    rows = page.frames(10_001)
    assert len(rows) <= page.FRAMES_MAX + 1
    assert (rows[0], rows[-1]) == (0, 10_000)


def test_a_second_is_as_bad_as_its_worst(made: Result) -> None:
    opened = results.open_result(made.folder)
    (told,) = quality.seconds(opened)
    assert (told["from_s"], told["to_s"]) == pytest.approx((0.0, 0.3))
    assert told["verdict"] == made.report["by_second"][0]["verdict"]
    opened.__dict__["report"] = {key: value for key, value in made.report.items() if key != "by_second"}
    (good,) = quality.seconds(opened)  # of an earlier version
    assert good["verdict"] == "good"
    assert (good["from_s"], good["to_s"]) == pytest.approx((0.0, 0.3))
    fit = np.array(made.motion.kinematic_qpos)
    fit[:, 0] += 0.07
    opened.__dict__["motion"] = replace(made.motion, kinematic_qpos=fit)
    (doubtful,) = quality.seconds(opened)
    assert doubtful["verdict"] == "doubtful"
    assert doubtful["reason"] == "7 cm from the kinematic fit at worst"
    status = made.motion.status.copy()
    status[-1] = 1
    opened.__dict__["motion"] = replace(made.motion, status=status, times_s=made.motion.times_s * 10)
    assert [second["verdict"] for second in quality.seconds(opened)] == ["good", "good", "bad"]
    assert quality.seconds(opened)[-1]["reason"] == "1 frame not simulated"


def test_the_camera_sees_what_it_saw(made: Result, run: Any) -> None:
    """Through WebGL's camera a point falls on the pixel that our own camera gives."""
    rows = np.arange(len(made.motion.times_s))
    camera = seen.make(made.report, rows, len(rows))
    assert camera is not None
    assert len(camera["views"]) == 1  # it stands still
    points = made.motion.joints_m[3, :5]
    local = np.column_stack((points @ TO_Y_UP.T, np.ones(5))) @ np.array(camera["views"][0]).reshape(3, 4).T
    pixels = np.array(camera["focal_px"]) * local[:, :2] / -local[:, 2:] * [1, -1] + camera["centre_px"]
    ours = cameras.project(cameras.at(run.fit.camera, slice(0, 1)), points[None])[0]
    np.testing.assert_allclose(pixels, ours + 0.5, atol=0.01)
    path = np.repeat(np.array(made.report["camera"]["world_to_camera"]), len(rows), axis=0)
    path[:, 0, 3] += np.arange(len(rows))  # carried along
    carried = {**made.report, "camera": {**made.report["camera"], "world_to_camera": path.tolist()}}
    moving = seen.make(carried, rows[::2], len(rows))
    assert moving is not None
    np.testing.assert_allclose(np.array(moving["views"])[:, 3] - camera["views"][0][3], rows[::2], atol=1e-5)
    assert seen.make({**made.report, "camera": None}, rows, len(rows)) is None
    assert seen.make({}, rows, len(rows)) is None  # of an earlier version


def test_stills_are_the_frames_of_the_overlay(tmp_path: Path) -> None:
    rows = np.arange(0, 30, 3)
    assert stills.make(tmp_path, rows) == []
    writer = cv2.VideoWriter(str(tmp_path / "overlay.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), 30.0, (64, 48))
    for grey in range(30):
        writer.write(np.full((48, 64, 3), 8 * grey, np.uint8))
    writer.release()
    found = stills.make(tmp_path, rows)
    assert [still["frame"] for still in found] == list(range(10))
    assert all(still["image"].startswith("data:image/jpeg;base64,") for still in found)


def test_reports_of_earlier_versions_have_tables_too(made: Result) -> None:
    old = {key: value for key, value in made.report.items() if key not in ("assumed", "agreement", "verdict")}
    titles = [table["title"] for table in tables.make(old)]
    assert titles == ["Person and floor", "Plausibility", "Settings", "Cost", "Exactness", "Windows"]
    assert tables.highlights(old)


def test_a_page_that_cannot_be_made_costs_a_line(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = results.write(job_of(tmp_path / "out"), run)
    monkeypatch.setattr(page, "render", lambda _: 1 / 0)
    assert viewer.add(result) == "division by zero"
    assert not (tmp_path / "out" / "report.html").exists()
    finished = running._with_page(result)
    assert finished.report["page"] == "division by zero"
    assert finished.report["verdict"] == result.report["verdict"]
    assert "page     report.html could not be made (division by zero); the motion is there" in summary.of(
        finished
    )
    with pytest.raises(ZeroDivisionError):
        viewer.write(result)


def test_the_command_makes_it_anew(made: Result, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    target = made.folder / "report.html"
    target.unlink()
    assert cli.main(["report", str(made.folder)]) == 0
    assert capsys.readouterr().out == f"written  {target}\n"
    results.check_writable(made.folder)  # it counts as a part of the result
    assert cli.main(["report", str(tmp_path / "none")]) == 2
    with pytest.raises(InputError, match="no such folder"):
        results.open_result(tmp_path / "none")


def test_a_notebook_shows_the_whole_page(made: Result, tmp_path: Path) -> None:
    assert simrecon.open_result is results.open_result  # the front door says how results are shown
    shown = made._repr_html_()
    assert shown is not None
    attribute = re.fullmatch(r'<iframe srcdoc="([^"]*)" sandbox="([^"]*)"[^>]*></iframe>', shown)
    assert attribute is not None
    assert "allow-same-origin" not in attribute[2]  # a page must not reach into the notebook
    inside = html.unescape(attribute[1])
    assert told(inside)["curves"] == told(page.render(made))["curves"]
    assert told(inside)["video"] is None  # which is not beside a notebook
    assert repr(made) == f"Result({str(made.folder)!r})"
    broken = tmp_path / "<b>"
    broken.mkdir()
    (broken / "motion.npz").write_bytes(b"")
    line = results.open_result(broken)._repr_html_()
    assert line is not None
    assert line.startswith("<p>")
    assert "&lt;b&gt;" in line
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Result, "to_html", None)
        assert made._repr_html_() is None  # without the front door a notebook shows `repr`


def test_results_of_another_version_and_files_are_one_line(
    made: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other"
    shutil.copytree(made.folder, other)
    report = other / "report.json"
    report.write_text(report.read_text(encoding="utf-8").replace("simrecon.result/1", "simrecon.result/2"))
    for words in (["report", str(other)], ["export", str(other), "--to", "glb"]):
        assert cli.main(words) == 2
        assert "schema: found 'simrecon.result/2'; valid: 'simrecon.result/1'" in capsys.readouterr().err
    shutil.copy(made.folder / "report.json", report)
    (other / "model.xml").write_text("<mujoco><worldbody><geom/>")
    assert cli.main(["report", str(other)]) == 2
    assert str(other / "model.xml") in capsys.readouterr().err
    (other / "model.xml").unlink()
    assert cli.main(["report", str(other)]) == 2
    assert capsys.readouterr().err.count("model.xml") == 1
    assert cli.main(["report", str(report)]) == 2
    assert "report.json: found a file; valid: a result folder" in capsys.readouterr().err


HOSTILE: tuple[tuple[str, Any], ...] = (
    ("agreement", {"fit_mean_m": "x"}), ("totals", {"seconds": {"kinematics": []}}), ("by_second", []),
    ("metrics", {"footskate_pct": []}), ("verdict", {"verdict": float("nan")}), ("camera", {"K": 1}),
    ("person", {"height_m": 1.7, "mass_kg": 60.0}),
)  # fmt: skip


@pytest.mark.parametrize(("key", "value"), HOSTILE)
def test_values_of_another_kind_in_a_report_are_one_line(
    made: Result, tmp_path: Path, key: str, value: Any
) -> None:
    other = tmp_path / "other"
    shutil.copytree(made.folder, other)
    report = made.report | {key: value} | ({"totals": []} if key == "person" else {})
    (other / "report.json").write_text(json.dumps(report), encoding="utf-8")
    with pytest.raises(InputError, match=r"report\.json: found a value of another kind than it has there"):
        page.render(results.open_result(other))


@pytest.mark.slow
def test_a_browser_shows_it(made: Result, tmp_path: Path) -> None:
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None:
        pytest.skip("needs Chromium")
    address = (made.folder / "report.html").as_uri() + "#t=0.2"
    command = [found, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", address]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True).stdout
    head = shown.split("<script")[0]
    assert 'data-ready="3d"' in shown[:300], shown[:300]
    assert head.count('class="track"') == 7
    assert re.search(r'id="now-time"[^>]*>0\.20 s', head)
    assert "L toe" in head
    assert head.count("<tr>") > 40
