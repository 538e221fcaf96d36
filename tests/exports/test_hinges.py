"""The person with hinges: the same motion without ball joints, and the layout that LocoMuJoCo loads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from simrecon import exports
from simrecon.body import hinges
from simrecon.exports.view import ResultView
from simrecon.geometry import rotations
from simrecon.sim.models import compile_text
from simrecon.sim.poses import posed

INFO = {"joint_names", "frequency", "body_names", "site_names"}
MODEL = {"njnt", "jnt_type", "nbody", "nsite", "site_bodyid", "site_pos", "site_quat"}
MODEL |= {f"body_{key}" for key in ("rootid", "weldid", "mocapid", "pos", "quat", "ipos", "iquat")}
DATA = {"qpos", "qvel", "xpos", "xquat", "cvel", "subtree_com", "site_xpos", "site_xmat", "split_points"}


def read(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        return dict(file)


def test_the_model_with_hinges_shows_the_same_poses(finished: Path, view: ResultView, tmp_path: Path) -> None:
    model_path, arrays_path = exports.export(finished, ("mjcf",), tmp_path)
    model, arrays = compile_text(model_path.read_text(encoding="utf-8")), read(arrays_path)
    assert set(model.jnt_type.tolist()) == {int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_HINGE)}
    assert [model.joint(row).name for row in range(model.njnt)] == arrays["joint_names"].tolist()
    assert model.body_subtreemass[1] == pytest.approx(view.body.mass_kg)
    assert (arrays["qpos"].shape[1], arrays["qvel"].shape[1]) == (model.nq, model.nv) == (55, 54)
    assert model.nu == 48
    names = view.body.skeleton.names
    rows = [model.body(name).id for name in names]
    for frame, data in enumerate(posed(model, arrays["qpos"])):
        np.testing.assert_allclose(data.xpos[rows], view.segments.origins_m[frame], atol=1e-6)
        assert rotations.angle_between(data.xquat[rows], view.segments.quats[frame]).max() < 1e-5


def test_a_motor_turns_its_hinge(view: ResultView) -> None:
    model = compile_text(hinges.mjcf(view.body))
    for row in range(model.nu):
        assert model.actuator(row).name == model.joint(model.actuator_trnid[row, 0]).name
    np.testing.assert_allclose(np.abs(model.actuator_gear[:, 0]), 1.0)


def test_angles_go_on_past_gimbal_lock() -> None:
    wanted = np.stack([np.full(60, 0.3), np.linspace(0.2, 2.9, 60), np.linspace(-0.5, 4.0, 60)], axis=1)
    turns = [rotations.exp(wanted[:, axis, None] * np.eye(3)[axis]) for axis in range(3)]
    whole = rotations.multiply(rotations.multiply(turns[0], turns[1]), turns[2])
    found = hinges.angles_xyz(rotations.matrix(whole)[:, None])[:, 0]
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_layout_of_locomujoco(finished: Path, view: ResultView, tmp_path: Path) -> None:
    """As `Trajectory.load` of 1.0 takes it: every key belongs to info, model or data, and fits the model."""
    path, model_path = exports.export(finished, ("locomujoco",), tmp_path, fps=100.0)
    arrays, model = read(path), compile_text(model_path.read_text(encoding="utf-8"))
    assert set(arrays) == INFO | MODEL | DATA
    kinds = set(arrays["jnt_type"].tolist())
    assert kinds <= {int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_HINGE)}
    count = len(arrays["qpos"])
    assert arrays["frequency"].tolist() == pytest.approx(100.0)
    assert arrays["split_points"].tolist() == [0, count]
    assert len(arrays["joint_names"]) == arrays["njnt"].item() == len(arrays["jnt_type"]) == model.njnt
    assert arrays["qpos"].shape == (count, sum(7 if kind == 0 else 1 for kind in arrays["jnt_type"]))
    assert arrays["qvel"].shape == (count, sum(6 if kind == 0 else 1 for kind in arrays["jnt_type"]))
    for key, size in (("xpos", 3), ("xquat", 4), ("cvel", 6), ("subtree_com", 3)):
        assert arrays[key].shape == (count, model.nbody, size)
    assert arrays["site_xmat"].shape == (count, model.nsite, 9)
    np.testing.assert_allclose(arrays["xpos"][0, 1], view.qpos[0, :3], atol=1e-9)


def test_locomujoco_loads_it(finished: Path, tmp_path: Path) -> None:
    trajectory = pytest.importorskip("loco_mujoco.trajectory", reason="loco-mujoco is not installed")
    path, _ = exports.export(finished, ("locomujoco",), tmp_path)
    loaded = trajectory.Trajectory.load(str(path), backend=np)
    assert loaded.data.is_complete
