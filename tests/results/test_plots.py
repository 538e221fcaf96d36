"""Curves and tables of a result: what is drawn is what is there."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from simrecon import results
from simrecon.errors import InputError
from simrecon.results import Result
from tests.support.runs import job_of


@pytest.fixture(scope="module")
def finished(run: Any, tmp_path_factory: pytest.TempPathFactory) -> Result:
    return results.write(job_of(tmp_path_factory.mktemp("plots") / "squat"), run)


@pytest.fixture
def plot(finished: Result, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setenv("MPLBACKEND", "agg")
    pytest.importorskip("matplotlib", reason="matplotlib is not installed")
    from matplotlib import pyplot

    pyplot.switch_backend("agg")
    yield finished.plot
    pyplot.close("all")


def test_forces_are_percent_of_body_weight(plot: Any, finished: Result) -> None:
    axes = plot.forces()
    labels = [line.get_label() for line in axes.lines]
    assert labels == ["left foot", "right foot", "all contacts"]
    whole = 100 * finished.motion.grf_N[:, 2] / (9.81 * finished.body.mass_kg)
    np.testing.assert_allclose(axes.lines[2].get_ydata(), whole)
    assert "body weight" in axes.get_ylabel()


def test_forces_have_their_bands(plot: Any, finished: Result) -> None:
    axes = plot.forces()
    assert len(axes.collections) == 3
    assert finished.motion.band_grf_N is not None
    highest = max(path.vertices[:, 1].max() for path in axes.collections[2].get_paths())
    share = 100 / (9.81 * finished.body.mass_kg)
    assert highest == pytest.approx(share * np.nanmax(finished.motion.band_grf_N[:, 2, 1]))


def test_contacts_are_bars_of_what_is_pushed(plot: Any) -> None:
    from matplotlib import pyplot

    _, axes = pyplot.subplots()
    assert plot.contacts(axes) is axes
    parts = [label.get_text() for label in axes.get_yticklabels()]
    assert set(parts) == {"left foot", "right foot"}
    assert len(axes.collections) == 2


def test_moments_of_chosen_joints_say_their_filter(plot: Any, finished: Result) -> None:
    axes = plot.moments(["left_knee"])
    found = finished.moments()
    own = found.moment_Nm[:, found.joints.index("left_knee"), 1]
    np.testing.assert_allclose(axes.lines[1].get_ydata(), own)
    assert f"below {found.cutoff_hz:.3g} Hz" in axes.get_ylabel()
    with pytest.raises(InputError, match="joints: found 'pelvis'"):
        finished.plot.moments(["pelvis"])


def test_angles_of_chosen_joints(plot: Any, finished: Result) -> None:
    axes = plot.angles(["left_knee"])
    assert [line.get_label() for line in axes.lines] == [f"left knee {axis}" for axis in "xyz"]
    bend = np.ptp(axes.lines[1].get_ydata())
    assert 5 < bend < 90
    with pytest.raises(InputError, match="joints: found 'left_kne', did you mean 'left_knee'"):
        finished.plot.angles(["left_kne"])


def test_a_table_has_units_in_its_names(finished: Result) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    table, motion = finished.to_pandas(), finished.motion
    assert table.index.name == "time_s"
    np.testing.assert_allclose(table.index, motion.times_s)
    toe = motion.joint_names.index("left_toe")
    np.testing.assert_allclose(table["left_toe_z_m"], motion.joints_m[:, toe, 2])
    np.testing.assert_allclose(table["grf_z_N"], motion.grf_N[:, 2])
    motor = [finished.model.actuator(row).name for row in range(finished.model.nu)].index("left_knee_y")
    np.testing.assert_allclose(table["left_knee_y_Nm"], motion.torque_Nm[:, motor])
    assert table["simulated"].all()
    assert len(set(table.columns)) == len(table.columns)


@pytest.mark.parametrize(("package", "call"), [("pandas", "to_pandas"), ("matplotlib", "plot")])
def test_a_missing_extra_is_one_line(
    finished: Result, monkeypatch: pytest.MonkeyPatch, package: str, call: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf"{call} needs {package}: python -m pip install '.\[plot\]'"):
        finished.to_pandas() if call == "to_pandas" else finished.plot.forces()
