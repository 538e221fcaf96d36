"""Body models that the user owns, by a synthetic file of SMPL's layout with simrecon's own shape space."""

from __future__ import annotations

import copyreg
import pickle
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csc_matrix

from simrecon import body as bodies
from simrecon.body import model_file, shape, shaped
from simrecon.body.shape import ShapeSpace
from simrecon.errors import InputError
from tests.support import smpl_layout

BETAS = np.array([0.5, 1.0, -0.5, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


def saved(folder: Path, **changes: Any) -> Path:
    path = folder / "model.npz"
    content = {key: value for key, value in (smpl_layout.arrays() | changes).items() if value is not None}
    np.savez(path, **content)
    return path


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> ShapeSpace:
    return model_file.read(saved(tmp_path_factory.mktemp("smpl")))


def test_joints_and_lengths_are_those_of_the_file(model: ShapeSpace) -> None:
    assert model.size == 10
    ours, theirs = shape.skeleton(BETAS), shape.skeleton(BETAS, model)
    for name, value in bodies.measure_template(
        theirs
    ).items():  # of the head the point, not the joint, is placed
        assert value == pytest.approx(
            bodies.measure_template(ours)[name], rel=2e-2 if name == "head" else 1e-5
        )
    np.testing.assert_allclose(theirs.offsets_m, ours.offsets_m, atol=1e-5)
    assert shape.stature_m(BETAS, model) == pytest.approx(shape.stature_m(BETAS), abs=2e-3)


def test_landmarks_are_where_simrecon_has_them(model: ShapeSpace) -> None:
    ours, theirs = shape.skeleton(np.zeros(10)), shape.skeleton(np.zeros(10), model)
    away = np.linalg.norm(ours.point_offsets_m - theirs.point_offsets_m, axis=1)
    assert dict(zip(ours.point_names, away, strict=True))["nose"] < 2e-3
    assert away.max() < 0.01


def test_primitives_are_fitted_to_its_skin(model: ShapeSpace) -> None:
    body = bodies.build(betas=BETAS, shapes=model, mass_kg=70.0)
    parts = {p.name: p for p in body.primitives}
    own = {p.name: p for p in bodies.build(betas=BETAS, mass_kg=70.0).primitives}
    assert sum(p.mass_kg for p in parts.values()) == pytest.approx(70.0, abs=1e-6)
    for name in ("left_thigh", "left_forearm", "ribs", "left_foot", "skull"):
        np.testing.assert_allclose(parts[name].size_m, own[name].size_m, atol=0.02)
        assert np.linalg.norm(parts[name].points_m.mean(axis=0) - own[name].points_m.mean(axis=0)) < 0.04
    assert body.shape_space == "model.npz"


def test_names_of_joints_serve_where_their_number_says_nothing(tmp_path: Path, model: ShapeSpace) -> None:
    arrays = smpl_layout.arrays()
    keep = [joint for joint in range(24) if joint not in (10, 11, 22, 23)]
    names = [
        "Hips", "LeftUpLeg", "RightUpLeg", "Spine", "LeftLeg", "RightLeg", "Spine2", "LeftFoot", "RightFoot",
        "Spine3", "Neck", "LeftShoulder", "RightShoulder", "Head", "LeftArm", "RightArm", "LeftForeArm",
        "RightForeArm", "LeftHand", "RightHand",
    ]  # fmt: skip
    new = {old: i for i, old in enumerate(keep)}
    weights = arrays["weights"].copy()
    for joint in (10, 11, 22, 23):
        weights[:, smpl_layout.PARENTS[joint]] += weights[:, joint]
    path = saved(
        tmp_path,
        weights=weights[:, keep],
        J_regressor=arrays["J_regressor"][keep],
        kintree_table=None,
        parents=np.array([-1] + [new[smpl_layout.PARENTS[joint]] for joint in keep[1:]]),
        joint_names=np.array(names),
    )
    read = model_file.read(path)
    np.testing.assert_allclose(
        read.points_m(BETAS)["left_elbow"], model.points_m(BETAS)["left_elbow"], atol=1e-9
    )
    np.testing.assert_allclose(read.weights, model.weights, atol=1e-12)


def as_published(arrays: dict[str, Any]) -> dict[str, Any]:
    """With the regressor as a sparse matrix, as SMPL's pickles have it."""
    return arrays | {"J_regressor": csc_matrix(arrays["J_regressor"])}


def test_pickles_as_published_are_read_without_running_them(
    tmp_path: Path, model: ShapeSpace, monkeypatch: pytest.MonkeyPatch
) -> None:
    chumpy = types.ModuleType("chumpy.ch")
    chumpy.Ch = type("Ch", (), {"__module__": "chumpy.ch", "__reduce__": lambda self: (  # type: ignore[attr-defined]
        copyreg._reconstructor, (type(self), object, None), self.__dict__)})  # type: ignore[attr-defined]  # fmt: skip
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    monkeypatch.setitem(sys.modules, "chumpy.ch", chumpy)
    content = as_published(smpl_layout.arrays())
    variable = chumpy.Ch()
    variable.x = content["shapedirs"]
    path = tmp_path / "basicModel.pkl"
    path.write_bytes(pickle.dumps(content | {"shapedirs": variable, "bs_type": "lrotmin"}, protocol=2))
    monkeypatch.undo()
    space = model_file.read(path)
    np.testing.assert_allclose(space.vertices_m(BETAS), model.vertices_m(BETAS), atol=1e-12)
    np.testing.assert_allclose(
        space.points_m(BETAS)["left_knee"], model.points_m(BETAS)["left_knee"], atol=1e-12
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"v_template": None}, "v_template: found no such key"),
        ({"weights": np.zeros((3, 24))}, r"weights: found an array of shape \(3, 24\)"),
        ({"shapedirs": np.full((2952, 3, 10), np.nan)}, "shapedirs: found no finite numbers"),
        ({"shapedirs": np.ones((2952, 3, 10)) * 1j}, "shapedirs: found no finite numbers"),
        ({"kintree_table": np.zeros((2, 24)) * 1j}, "kintree_table: found shape"),
        ({"f": np.full((4, 3), 9999)}, "f: found 9999 to 9999; valid: from 0 to"),
        ({"weights": np.eye(24)[np.zeros(2952, int)]}, "weights: no vertex belongs to 'spine'"),
        ({"kintree_table": np.array([range(24), range(24)])}, "a joint comes before its parent"),
        ({"kintree_table": np.zeros((2, 5))}, "kintree_table: found shape"),
        ({"joint_names": np.array(["a"] * 24)}, "joint_names: none of them is 'pelvis'"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    path = saved(tmp_path, **changes)
    with pytest.raises(InputError, match=message) as caught:
        model_file.read(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_other_units_and_inverted_faces_are_refused(tmp_path: Path) -> None:
    arrays = smpl_layout.arrays()
    with pytest.raises(InputError, match="the body is 17"):
        model_file.read(
            saved(tmp_path, v_template=100 * arrays["v_template"], shapedirs=100 * arrays["shapedirs"])
        )
    with pytest.raises(InputError, match="the faces look inwards"):
        model_file.read(saved(tmp_path, f=arrays["f"][:, ::-1]))


def test_its_parameters_are_its_own(model: ShapeSpace) -> None:
    with pytest.raises(InputError, match=r"up to 10 numbers \(shape space model.npz\)"):
        shaped.make(np.zeros(12), shapes=model)
