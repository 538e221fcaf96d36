"""A result as USD: opened by Pixar's library where it is installed."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from simrecon import cli, exports
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations


def test_what_is_missing_is_said_in_one_line(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pxr", None)
    assert cli.main(["export", str(finished), "--to", "trc,usd", "-o", str(tmp_path / "new")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "--to usd needs pxr: python -m pip install '.[usd]'" in said
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("rig", ["simrecon", "mixamo"])
def test_skeleton_and_skin_are_where_the_person_is(
    finished: Path, view: ResultView, tmp_path: Path, rig: str
) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from pxr import Usd, UsdGeom, UsdSkel

    (path,) = exports.export(finished, ("usd",), tmp_path, rig=rig)
    stage = Usd.Stage.Open(str(path))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetEndTimeCode() == len(view.times_s) - 1
    assert stage.GetTimeCodesPerSecond() == pytest.approx(view.rate_hz)
    cache = UsdSkel.Cache()
    skeleton = UsdSkel.Skeleton.Get(stage, "/World/person/skeleton")
    root = UsdSkel.Root.Get(stage, "/World/person")
    cache.Populate(root, Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(skeleton)
    names = list(query.GetJointOrder())
    assert names[0] == ("mixamorig_Hips" if rig == "mixamo" else "pelvis")
    for frame in (0, 5, 9):
        moved = np.array(query.ComputeJointSkelTransforms(Usd.TimeCode(frame)))
        np.testing.assert_allclose(moved[:, 3, :3], view.segments.origins_m[frame], atol=1e-5)
        np.testing.assert_allclose(  # rows are axes
            moved[0, :3, :3], turned(view, frame), atol=1e-5
        )
    mesh = UsdGeom.Mesh.Get(stage, "/World/person/skin")
    points = np.array(mesh.GetPointsAttr().Get())
    weights = np.array(UsdSkel.BindingAPI(mesh.GetPrim()).GetJointWeightsAttr().Get())
    np.testing.assert_allclose(weights.reshape(len(points), -1).sum(axis=1), 1.0, atol=1e-5)
    assert stage.GetPrimAtPath("/World/scene").GetChildren()


def turned(view: ResultView, frame: int) -> np.ndarray:
    return rotations.matrix(view.segments.quats[frame, 0]).T
