"""Forces for OpenSim: read back by a reader written here, and by OpenSim itself where it is installed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from simrecon import exports, results
from simrecon.errors import InputError
from simrecon.exports import mot
from simrecon.exports import view as views
from simrecon.exports.axes import TO_Y_UP
from simrecon.exports.forces import Forces
from simrecon.exports.view import ResultView
from tests.support import osim
from tests.support.runs import job_of

STATED = ("nRows", "nColumns")


def read(path: Path) -> dict[str, np.ndarray]:
    """Columns by name; what the header states is what follows."""
    lines = path.read_text(encoding="ascii").splitlines()
    begin = lines.index("endheader")
    stated = dict(line.split("=") for line in lines[1:begin])
    names = lines[begin + 1].split("\t")
    table = np.array([line.split("\t") for line in lines[begin + 2 :]], float)
    assert (int(stated["nRows"]), int(stated["nColumns"])) == table.shape
    assert (stated["version"], stated["inDegrees"]) == ("1", "no")
    return dict(zip(names, table.T, strict=True))


@pytest.fixture
def files(finished: Path, tmp_path: Path) -> dict[str, np.ndarray]:
    paths = exports.export(finished, ("mot",), tmp_path)
    assert [path.name for path in paths] == ["forces.mot", "forces.xml"]
    return read(paths[0])


def of(table: dict[str, np.ndarray], word: str) -> np.ndarray:
    return np.stack([table[word + axis] for axis in "xyz"], axis=1)


def test_forces_are_those_of_the_simulation(files: dict[str, np.ndarray], finished: Path) -> None:
    motion = results.read_motion(finished)
    time = files["time"]
    assert time[0] == 0.0
    assert time[-1] == pytest.approx(motion.times_s[-1] - motion.times_s[0])
    force = sum(of(files, f"ground_force_{side}_v") for side in "rl") @ TO_Y_UP  # back to z up
    impulse = np.trapezoid(force, time, axis=0)
    whole = (motion.grf_N[1:] * np.diff(motion.times_s)[:, None]).sum(axis=0)
    np.testing.assert_allclose(impulse[2], whole[2], rtol=0.05)
    for side in "rl":
        assert of(files, f"ground_force_{side}_v")[:, 1].min() >= 0
        places = of(files, f"ground_force_{side}_p")
        assert np.abs(places[:, 1]).max() < 0.02  # on the floor
    right, left = (of(files, f"ground_force_{side}_p")[:, 2].mean() for side in "rl")
    assert right > 0.03
    assert left < -0.03  # z of the file points right


def test_sums_keep_force_moment_and_impulse(view: ResultView) -> None:
    forces = view.forces
    span = 0.05
    times = forces.times_s[0] + span * (0.5 + np.arange(4))
    loads = forces.at(times, span)
    before = forces.sums[np.searchsorted(forces.times_s, forces.times_s[0] + 4 * span - 1e-9)]
    np.testing.assert_allclose(span * loads.force_N.sum(axis=0), before[:, :3], rtol=1e-6, atol=1e-9)
    foot = forces.segments.index("left_ankle")
    force, centre, moment = (loads.force_N[:, foot], loads.centre_m[:, foot], loads.moment_Nm[:, foot])
    about_origin = moment + np.cross(np.nan_to_num(centre), force)
    np.testing.assert_allclose(span * about_origin.sum(axis=0), before[foot, 3:6], rtol=1e-6)
    assert np.abs(moment[:, :2]).max() < 0.02 * np.abs(force[:, 2]).max()  # a free moment is vertical
    assert np.isnan(loads.centre_m[:, forces.segments.index("head")]).all()


def test_the_loads_name_the_columns_and_bodies(finished: Path, tmp_path: Path) -> None:
    table, xml = exports.export(finished, ("mot",), tmp_path)
    columns = read(table)
    loads = ET.parse(xml).getroot().find("ExternalLoads")
    assert loads is not None
    assert loads.findtext("datafile") == table.name
    found = {force.findtext("applied_to_body"): force for force in loads.iter("ExternalForce")}
    assert set(found) == {"calcn_r", "calcn_l"}
    for force in found.values():
        for key in ("force", "point", "torque"):
            word = force.findtext(f"{key}_identifier")
            assert all(f"{word}{axis}" in columns for axis in "xyz")
            if key != "torque":
                assert force.findtext(f"{key}_expressed_in_body") == "ground"


def test_what_else_is_pushed_has_columns_of_its_own(view: ResultView) -> None:
    forces = view.forces
    sums = forces.sums.copy()
    hand = forces.segments.index("left_wrist")
    sums[:, hand] = sums[:, forces.segments.index("left_ankle")]
    leaning = replace(view, choices=view.choices)
    leaning.__dict__["forces"] = Forces(forces.times_s, forces.segments, sums)
    files = mot.write(leaning)
    assert b"ground_force_left_wrist_vx" in files["forces.mot"]
    assert b"<applied_to_body>hand_l</applied_to_body>" in files["forces.xml"]


def test_centres_between_contacts_do_not_jump() -> None:
    centre = np.array([[np.nan] * 3, [0.0, 0, 0], [np.nan] * 3, [1.0, 0, 2], [np.nan] * 3])
    wanted = np.array([[0.0, 0, 0], [0, 0, 0], [0.5, 0, 1], [1, 0, 2], [1, 0, 2]])
    np.testing.assert_allclose(mot.filled(centre), wanted)
    assert not mot.filled(np.full((3, 3), np.nan)).any()


def test_a_fit_has_no_forces(finished: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--of fit: forces belong to the simulation"):
        exports.export(finished, ("trc", "mot"), tmp_path / "new", of="fit")
    assert not (tmp_path / "new").exists()


def test_motion_and_forces_go_through_the_same_filter(finished: Path) -> None:
    view = views.of(results.open_result(finished), views.Choices(fps=100.0, cutoff_hz=8.0))
    assert residual(view) < residual(replace(view, choices=views.Choices(fps=100.0)))


def residual(view: ResultView) -> float:
    """Mean of what mass times acceleration lacks of the forces, N."""
    force = view.forces.at(view.times_s, view.interval_s).force_N.sum(axis=1)
    acceleration = np.diff(view.com_m, 2, axis=0) / view.interval_s**2
    lacks = view.body.mass_kg * (acceleration + np.array([0.0, 0.0, 9.81])) - force[1:-1]
    return float(np.linalg.norm(lacks[3:-3], axis=1).mean())


@pytest.mark.slow
def test_opensim_finds_the_pose_and_needs_no_residual(
    run: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the root, where no motor acts: at most 5 % of body weight, and that times a metre."""
    monkeypatch.chdir(tmp_path)  # it writes a log where it is loaded
    opensim = pytest.importorskip("opensim", reason="opensim is not installed")
    opensim.Logger.setLevelString("error")
    view = views.of(results.write(job_of(tmp_path / "out"), run), views.Choices(fps=60.0, cutoff_hz=6.0))
    exports.export(view.result, ("mot",), tmp_path, fps=60.0, cutoff_hz=6.0)
    osim.model(opensim, view.body, tmp_path / "model.osim")
    osim.coordinates(view, tmp_path / "coordinates.mot")
    span_s = float(view.times_s[-1] - view.times_s[0])
    found = osim.inverse_dynamics(opensim, tmp_path, tmp_path / "forces.xml", -1.0, span_s)
    weight_N = 9.81 * view.body.mass_kg
    (markers,) = exports.export(view.result, ("trc",), tmp_path, fps=60.0, cutoff_hz=6.0)
    names = view.body.skeleton.point_names
    off_m = osim.inverse_kinematics(opensim, tmp_path, markers, names, span_s)
    print(f"markers: {1e3 * off_m.max():.2f} mm off at most")
    assert len(off_m) == len(view.times_s)
    assert off_m.max() < 1e-3
    for word, unit in (("t", "force"), ("r", "moment")):
        root = np.stack([found[f"pelvis_{word}{axis}_{unit}"] for axis in "xyz"], axis=1)
        share = np.linalg.norm(root[2:-2], axis=1).mean() / weight_N
        print(f"root {unit}: {100 * share:.2f} % of body weight")
        assert share < 0.05
