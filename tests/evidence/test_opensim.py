from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evidence import opensim

TRC = """PathFileType\t4\t(X/Y/Z)\ta.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
100\t100\t3\t2\tmm\t100\t1\t3
Frame#\tTime\theel\t\t\ttoe\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.00\t1000\t200\t30\t1\t2\t3
2\t0.01\t1001\t200\t30\t\t\t
3\t0.02\t1002\t200\t30\t1\t2\tNaN
"""
MOT = """walk
version=1
inDegrees=yes
endheader
time\tground_force_1_vx\tground_force_1_vy\tground_force_1_vz
0.00\t1\t2\t3
0.01\t4\t5\t6
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "file"
    path.write_text(text, encoding="utf-8")
    return path


def test_markers_come_out_in_metres_with_z_up(tmp_path: Path) -> None:
    found = opensim.read_trc(written(tmp_path, TRC))
    assert found.names == ("heel", "toe")
    np.testing.assert_allclose(found.times_s, [0, 0.01, 0.02])
    np.testing.assert_allclose(found.of("heel")[0], [1.0, -0.03, 0.2])
    assert np.isfinite(found.of("toe")).all(-1).tolist() == [True, False, False]


def test_columns_keep_their_unit_and_vectors_turn(tmp_path: Path) -> None:
    found = opensim.read_mot(written(tmp_path, MOT))
    assert found.in_degrees
    np.testing.assert_allclose(found.vectors("ground_force_1_v"), [[1, -3, 2], [4, -6, 5]])
    with pytest.raises(InputError, match=r"no column ground_force_2_vx"):
        found.vectors("ground_force_2_v")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("PathFileType", "Path", "PathFileType"),
        ("\tmm\t", "\tfurlong\t", "Units: found 'furlong'; valid: m, cm, mm"),
        ("\ttoe", "\theel", "heel more than once"),
        ("1001", "x", "line 8: found .x.; valid: numbers"),
        ("0.02\t", "0.01\t", "times that do not increase"),
        ("1002", "inf", "infinite"),
    ],
)
def test_bad_markers(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        opensim.read_trc(written(tmp_path, TRC.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("endheader", "end", "no line endheader"),
        ("inDegrees=yes", "inDegrees=maybe", "inDegrees: found 'maybe'"),
        ("time\t", "t\t", "column names"),
        ("_vy", "_vx", "more than once"),
        ("0.01\t4\t5\t6\n", "", "1 rows"),
    ],
)
def test_bad_columns(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        opensim.read_mot(written(tmp_path, MOT.replace(old, new, 1)))


def test_no_file_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: cannot be read"):
        opensim.read_trc(tmp_path / "nowhere")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="a MOT or STO file"):
        opensim.read_mot(tmp_path / "bytes")
