"""A result as C3D: read back by simrecon's own reader, and by ezc3d where it is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import exports, results
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import c3d_file
from simrecon.exports import c3d as writer
from simrecon.exports import view as views
from simrecon.exports.view import ResultView


@pytest.fixture
def path(finished: Path, tmp_path: Path) -> Path:
    (path,) = exports.export(finished, ("c3d",), tmp_path)
    return path


def test_points_are_read_back(path: Path, view: ResultView) -> None:
    file = c3d_file.parse(Content(path, "c3d"))
    assert file.rate_hz == pytest.approx(view.rate_hz, rel=1e-6)
    np.testing.assert_allclose(file.places, 1e3 * view.points_m, atol=1e-3)
    point = file.parameters["POINT"]
    assert [word.strip() for word in point["LABELS"]] == list(view.body.skeleton.point_names)
    assert point["UNITS"] == ["mm"]
    assert list(file.parameters["FORCE_PLATFORM"]["TYPE"]) == [2, 2]


def test_platforms_carry_the_whole_wrench(view: ResultView) -> None:
    channels, corners = writer.platforms(view)
    forces, middle = view.forces, corners.mean(axis=0)
    count = channels.shape[1]
    span = view.interval_s / count
    loads = forces.at(view.times_s[0] + span * np.arange(len(view.times_s) * count), span)
    rows = channels.reshape(-1, 2, 6)
    for plate, foot in enumerate(writer.FEET):
        row = forces.segments.index(foot)
        force, moment = rows[:, plate, :3] @ writer.DOWN, rows[:, plate, 3:] @ writer.DOWN / 1e3
        np.testing.assert_allclose(force, loads.force_N[:, row], atol=1e-9)
        arm = np.nan_to_num(loads.centre_m[:, row]) - middle * np.isfinite(loads.centre_m[:, row])
        np.testing.assert_allclose(moment, loads.moment_Nm[:, row] + np.cross(arm, force), atol=1e-9)


def test_a_fit_has_no_platforms(finished: Path, tmp_path: Path) -> None:
    (path,) = exports.export(finished, ("c3d",), tmp_path, of="fit")
    file = c3d_file.parse(Content(path, "c3d"))
    fit = views.of(results.open_result(finished), views.Choices(of="fit"))
    np.testing.assert_allclose(file.places, 1e3 * fit.points_m, atol=1e-3)
    assert "FORCE_PLATFORM" not in file.parameters


def test_more_frames_than_a_word_holds() -> None:
    places = np.ones((70000, 1, 3))
    raw = writer.c3d(places, np.zeros((70000, 0, 0)), 100.0, {"POINT": {"USED": 1, "DATA_START": 0}})
    assert int.from_bytes(raw[8:10], "little") == 65535
    assert b"ACTUAL_END_FIELD" in raw


@pytest.mark.parametrize("of", ["simulation", "fit"])
def test_ezc3d_reads_points_and_platforms(finished: Path, tmp_path: Path, of: str) -> None:
    ezc3d: Any = pytest.importorskip("ezc3d", reason="ezc3d is not installed")
    (path,) = exports.export(finished, ("c3d",), tmp_path, of=of)
    view = views.of(results.open_result(finished), views.Choices(of=of))
    file = ezc3d.c3d(str(path), extract_forceplat_data=of == "simulation")
    points = file["data"]["points"][:3].transpose(2, 1, 0)
    np.testing.assert_allclose(points, 1e3 * view.points_m, atol=1e-3)
    assert file["parameters"]["POINT"]["RATE"]["value"][0] == pytest.approx(view.rate_hz, rel=1e-6)
    if of == "fit":
        return
    forces = view.forces
    for plate, foot in zip(file["data"]["platform"], writer.FEET, strict=True):
        count = plate["force"].shape[1] // len(view.times_s)
        span = view.interval_s / count
        loads = forces.at(view.times_s[0] + span * np.arange(len(view.times_s) * count), span)
        row = forces.segments.index(foot)
        np.testing.assert_allclose(plate["force"].T, loads.force_N[:, row], atol=1e-3)
        pressed = loads.force_N[:, row, 2] > 20
        assert pressed.sum() > 10
        centre = plate["center_of_pressure"].T[pressed] / 1e3
        assert np.linalg.norm((centre - loads.centre_m[pressed, row])[:, :2], axis=1).max() < 2e-3
        np.testing.assert_allclose(
            plate["Tz"].T[pressed, 2] / 1e3, loads.moment_Nm[pressed, row, 2], atol=0.2
        )
