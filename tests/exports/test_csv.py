"""Tables: what their names say is what they hold."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from simrecon import exports
from simrecon.exports.view import ResultView


def read(path: Path) -> dict[str, np.ndarray]:
    with path.open(encoding="ascii", newline="") as stream:
        names, *rows = csv.reader(stream)
    table = np.array([[float(word or "nan") for word in row] for row in rows])
    assert len(set(names)) == len(names)
    return dict(zip(names, table.T, strict=True))


def test_tables_hold_the_motion_and_its_forces(finished: Path, view: ResultView, tmp_path: Path) -> None:
    motion, forces, moments = (read(path) for path in exports.export(finished, ("csv",), tmp_path))
    np.testing.assert_allclose(motion["time_s"], forces["time_s"])
    np.testing.assert_allclose(motion["root_z_m"], view.qpos[:, 2], atol=1e-6)
    quats = np.stack([motion[f"pelvis_q{axis}"] for axis in "xyzw"], axis=1)
    np.testing.assert_allclose(quats, view.qpos[:, [4, 5, 6, 3]], atol=1e-6)
    toe = view.body.skeleton.point_names.index("left_toe")
    np.testing.assert_allclose(motion["left_toe_y_m"], view.points_m[:, toe, 1], atol=1e-6)
    upward = sum(values for name, values in forces.items() if name.endswith("_force_z_N"))
    assert np.mean(upward) == pytest.approx(9.81 * view.body.mass_kg, rel=0.3)
    assert not any(name.startswith("head_") for name in forces)
    found = view.result.moments()
    knee = found.joints.index("left_knee")
    own = np.interp(view.times_s, view.result.motion.times_s, found.moment_Nm[:, knee, 1])
    np.testing.assert_allclose(moments["left_knee_moment_y_Nm"], own, atol=1e-3)
    power = np.interp(view.times_s, view.result.motion.times_s, found.power_W[:, knee])
    np.testing.assert_allclose(moments["left_knee_power_W"], power, atol=1e-2)
    assert set(moments["cutoff_Hz"]) == {round(found.cutoff_hz, 6)}


def test_a_cutoff_is_brought_below_half_the_frame_rate(finished: Path, tmp_path: Path) -> None:
    exports.export(finished, ("csv",), tmp_path, fps=30.0, cutoff_hz=40.0)
    assert set(read(tmp_path / "moments.csv")["cutoff_Hz"]) == {12.0}


def test_a_fit_has_no_table_of_forces(finished: Path, tmp_path: Path) -> None:
    paths = exports.export(finished, ("csv",), tmp_path, of="fit")
    assert [path.name for path in paths] == ["motion.csv"]
