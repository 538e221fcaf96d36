"""A result as BVH, read back by simrecon's own reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon import cli, evidence, exports, results
from simrecon.errors import InputError
from simrecon.evidence.content import Content
from simrecon.evidence.mocap import hierarchy
from simrecon.exports import bvh as writer
from simrecon.exports import view as views
from simrecon.exports.axes import LOCAL, TO_Y_UP
from simrecon.geometry import rotations
from simrecon.results import kinematic
from simrecon.types import Array

POINTS = tuple(
    f"{side}_{joint}"
    for side in ("left", "right")
    for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "mtp")
)


def test_bvh_is_read_back_in_the_same_world(finished: Path) -> None:
    (path,) = exports.export(finished, ("bvh",))
    assert path == finished / "export" / "motion.bvh"
    motion, found = results.read_motion(finished), evidence.read(path)
    kept = np.delete(np.arange(10), 4)  # the frame that was dropped is in the file
    np.testing.assert_allclose(found.times_s[kept], motion.times_s - motion.times_s[0], atol=1e-6)
    for point in ("neck", "skull_base", *POINTS):
        ours = motion.joints_m[:, motion.joint_names.index(point)]
        theirs = found.joints_m[:, found.joint_names.index(point)]
        np.testing.assert_allclose(theirs[kept], ours, atol=1e-4, err_msg=point)
    results.check_writable(finished)  # it counts as a part of the result
    assert sorted(p.name for p in finished.iterdir() if "partial" in p.name) == []


def test_rotations_are_read_back(finished: Path) -> None:
    """The file's rotations, composed anew, are those of the segments to 1e-4 rad."""
    (path,) = exports.export(finished, ("bvh",))
    joints, interval_s, values = hierarchy.parse(Content(path, "text"))
    assert interval_s == pytest.approx(1 / 30, abs=1e-6)
    body, motion = results.open_result(finished).body, results.read_motion(finished)
    quats = motion.qpos[:, 3 : kinematic.coordinates(body)].reshape(len(motion.qpos), -1, 4)
    named = [joint for joint in joints if joint.channels]
    assert [joint.name for joint in named][:4] == ["Hips", "Spine", "Spine1", "Neck"]
    segments = [i for i, joint in enumerate(named) if not joint.name.endswith("ToeBase")]
    kept = np.delete(np.arange(10), 4)
    angles = np.radians(values[:, 3:].reshape(len(values), -1, 3))[kept][:, segments]  # (T, 17, 3)
    world = TO_Y_UP.T @ composed(angles[:, 0]) @ LOCAL
    local = LOCAL.T @ composed(angles[:, 1:]) @ LOCAL
    ours = rotations.multiply(body.skeleton.rest[1:], quats[:, 1:])
    assert rotations.angle_between(rotations.from_matrix(world), quats[:, 0]).max() < 1e-4
    assert rotations.angle_between(rotations.from_matrix(local), ours).max() < 1e-4


def composed(angles: Array) -> Array:
    """R_z R_x R_y of angles (..., 3) as matrices."""
    turns = [rotations.exp(angles[..., i, None] * np.eye(3)[axis]) for i, axis in enumerate((2, 0, 1))]
    return rotations.matrix(rotations.multiply(rotations.multiply(turns[0], turns[1]), turns[2]))


def test_angles_do_not_jump(rng: np.random.Generator) -> None:
    angles = np.linspace([-2.0, -1.4, -6.0], [9.0, 1.4, 4.0], 50)[:, None] + rng.uniform(
        -0.05, 0.05, (50, 3, 3)
    )
    found = writer.euler_zxy(composed(angles))
    np.testing.assert_allclose(composed(found), composed(angles), atol=1e-9)
    assert np.abs(np.diff(found, axis=0)).max() < 0.5


def test_the_command_writes_elsewhere_too(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["export", str(finished), "--to", "bvh", "-o", str(tmp_path / "new")]) == 0
    assert capsys.readouterr().out == f"written  {tmp_path / 'new' / 'motion.bvh'}\n"
    assert cli.main(["export", str(finished), "--to", "fbx"]) == 2
    assert "--to: found fbx; valid: bvh" in capsys.readouterr().err
    with pytest.raises(InputError, match="no such folder"):
        exports.export(tmp_path / "none", ("bvh",))


@pytest.mark.parametrize("rig", views.RIGS)
def test_a_rig_has_its_names_and_the_same_motion(finished: Path, tmp_path: Path, rig: str) -> None:
    (path,) = exports.export(finished, ("bvh",), tmp_path, rig=rig)
    joints, _, _ = hierarchy.parse(Content(path, "text"))
    names = [joint.name for joint in joints if joint.channels]
    wanted = {
        "simrecon": ("Hips", "LeftUpLeg", "RightToeBase"),
        "mixamo": ("mixamorig:Hips", "mixamorig:Spine2", "mixamorig:RightShoulder"),
        "lafan1": ("Hips", "Spine2", "LeftShoulder", "RightToe"),
        "rokoko": ("Spine3", "LeftThigh", "RightShin"),
    }
    assert set(wanted[rig]) <= set(names)
    assert len(names) == len(set(names)) == (19 if rig == "simrecon" else 22)
    motion, found = results.read_motion(finished), evidence.read(path)
    kept = np.delete(np.arange(10), 4)
    for point in POINTS:
        ours = motion.joints_m[:, motion.joint_names.index(point)]
        theirs = found.joints_m[:, found.joint_names.index(point)]
        np.testing.assert_allclose(theirs[kept], ours, atol=1e-4, err_msg=point)
