"""3DPW, PHC, HumanML3D and GEM-X: files in their layouts, and the motion that they were made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, resources, trust
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.keypoints import layouts
from simrecon.evidence.smpl import motion as smpl
from simrecon.geometry import camera as cameras
from simrecon.geometry import rotations
from tests.support import foreign_files as foreign
from tests.support import people
from tests.support.foreign_files import FPS, T

LENS = np.array([[1961.0, 0, 540], [0, 1969, 960], [0, 0, 1]])
TO_Y_UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def smpl_names(count: int = 24) -> tuple[str, ...]:
    return smpl.names()[:count]


def walking(count: int = 24, frames: int = T) -> np.ndarray:
    """Joints (T, count, 3) of a person who walks, z up, in the names of SMPL."""
    return people.named(people.walking(frames, speed_mps=1.0), smpl_names(count))


# --- 3DPW


def threedpw(folder: Path, persons: int = 1, **change: Any) -> Path:
    """A sequence, y up; the camera walks beside the person and sees all but the last three frames."""
    joints = walking() @ TO_Y_UP.T
    place = np.array([0.0, 1.2, 4.0]) + 1.0 * np.arange(T)[:, None] / FPS * [1.0, 0.0, 0.0]
    axes = np.diag([1.0, -1.0, -1.0])  # rows: x right, y down, z along -z of the world
    path = np.tile(np.eye(4), (T, 1, 1))
    path[:, :3, :3] = axes
    path[:, :3, 3] = -(axes @ place[..., None])[..., 0]
    seen = people.named(people.walking(T, speed_mps=1.0), layouts.layout("openpose_18")) @ TO_Y_UP.T
    own = seen @ axes.T + path[:, None, :3, 3]
    pixels = own[..., :2] / own[..., 2:] * [LENS[0, 0], LENS[1, 1]] + LENS[:2, 2]
    points = np.concatenate((pixels, np.full((T, 18, 1), 0.9)), axis=-1)
    valid = np.arange(T) < T - 3
    tree = {
        "sequence": "made_00", "genders": ["m"] * persons, "betas": [np.zeros(10)] * persons,
        "poses": [np.zeros((T, 72))] * persons, "trans": [np.zeros((T, 3))] * persons,
        "jointPositions": [(joints + np.array([k, 0, 0])).reshape(T, 72) for k in range(persons)],
        "poses2d": [np.swapaxes(points, 1, 2)] * persons, "img_frame_ids": np.arange(T),
        "cam_poses": path, "cam_intrinsics": LENS, "campose_valid": [valid.astype(int)] * persons,
    } | change  # fmt: skip
    return foreign.save_pickle(folder / "made_00.pkl", tree, protocol=2)


def test_3dpw_gives_joints_landmarks_and_a_moving_camera(tmp_path: Path) -> None:
    found = evidence.read(threedpw(tmp_path))
    assert found.reading.startswith("3DPW: up y (the person stands along it")
    assert found.joint_names == smpl_names()
    np.testing.assert_allclose(found.joints_m, walking(), atol=1e-9)
    np.testing.assert_allclose(np.diff(found.times_s), 1 / 30)
    assert found.camera is not None
    assert found.camera.lens.image_size_px == (1080, 1920)
    assert not cameras.is_still(found.camera)
    wanted = people.named(people.walking(T, speed_mps=1.0), layouts.layout("openpose_18"))
    np.testing.assert_allclose(cameras.project(found.camera, wanted)[:-3], found.keypoints_px[:-3], atol=1e-6)
    assert np.isnan(found.keypoints_px[-3:]).all()
    assert (found.scores[-3:] == 0).all()
    assert not found.ground_known
    assert trust.of(found).joints_m == 0.03


def test_of_two_people_of_3dpw_one_is_chosen(tmp_path: Path) -> None:
    path = threedpw(tmp_path, persons=2)
    with pytest.raises(InputError, match="people: found 2: 0"):
        evidence.read(path)
    found = evidence.read(path, Options(person="1"))
    np.testing.assert_allclose(found.joints_m, walking() + np.array([1, 0, 0]), atol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"jointPositions": [np.zeros((T, 60))]}, r"jointPositions: found shape \(12, 60\)"),
        ({"jointPositions": np.zeros((T, 72))}, "jointPositions: found a ndarray; valid: a list of people"),
        ({"cam_poses": np.zeros((T, 4, 4))}, "cam_poses: found rotations off orthogonal by 1"),
        ({"cam_poses": np.tile(np.eye(4), (5, 1, 1))}, r"cam_poses: found shape \(5, 4, 4\)"),
        ({"cam_intrinsics": np.zeros((3, 3))}, "cam_intrinsics: found"),
        ({"poses2d": []}, r"poses2d\[0\]: found no array"),
        ({"campose_valid": [np.ones(3)]}, "campose_valid: found 3 values for 12 frames"),
    ],
)
def test_bad_sequences_of_3dpw(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        evidence.read(threedpw(tmp_path, **change))


# --- PHC


def phc(folder: Path, count: int = 1, **change: Any) -> Path:
    """As `joblib.dump` writes it, z up."""
    vectors, place = foreign.poses()
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    root = rotations.from_matrix(turn @ rotations.matrix(rotations.exp(vectors[:, 0])))
    aa = np.concatenate((rotations.log(root), vectors[:, 1:].reshape(T, 69)), axis=1)
    pelvis = foreign.y_to_z(place + np.array(resources.toml("models", "body", "smpl.toml")["smpl"]["pelvis"]))
    motion = {
        "pose_quat_global": np.zeros((T, 24, 4)), "pose_quat": np.zeros((T, 24, 4)), "pose_aa": aa,
        "trans_orig": pelvis - smpl.offsets_m("smpl")[0], "root_trans_offset": pelvis, "beta": np.zeros(10),
        "gender": "neutral", "fps": 30.0,
    } | change  # fmt: skip
    motion = {key: value for key, value in motion.items() if value is not None}
    return foreign.save_joblib(folder / "motions.pkl", {f"0-walk_{k}": motion for k in range(count)})


@pytest.mark.parametrize("change", [{}, {"root_trans_offset": None}, {"fps": 30}])
def test_phc_round_trip(tmp_path: Path, change: dict[str, Any]) -> None:
    found = evidence.read(phc(tmp_path, **change))
    vectors, place = foreign.poses()
    table = resources.toml("models", "body", "smpl.toml")
    np.testing.assert_allclose(
        found.joints_m, foreign.y_to_z(foreign.smpl_joints(table, "smpl", vectors, place)), atol=1e-6
    )
    np.testing.assert_allclose(np.diff(found.times_s), 1 / 30)
    assert found.reading.startswith("PHC: SMPL parameters, frame world, up z")
    assert found.trust == "mocap"


def test_of_many_motions_of_phc_one_is_chosen(tmp_path: Path) -> None:
    path = phc(tmp_path, count=3)
    with pytest.raises(InputError, match=r"people: found 3: 0-walk_0 \(12 frames\)"):
        evidence.read(path)
    assert "motion 0-walk_2 of 3" in evidence.read(path, Options(person="0-walk_2")).reading


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dof": np.zeros((T, 29))}, r"joint angles of a robot \(dof\); valid: a motion of SMPL's body"),
        ({"pose_aa": np.zeros((T, 90))}, r"pose_aa: found shape \(12, 90\); valid: \(T, 72\)"),
        (
            {"root_trans_offset": np.zeros((5, 3))},
            r"pose_aa: found shape \(12, 72\); valid: shape \(T, 72\), not empty, T = 5",
        ),
        ({"root_trans_offset": None, "trans_orig": None}, "trans_orig: found no such key"),
        ({"fps": 1e6}, "fps: found 1e"),
    ],
)
def test_bad_motions_of_phc(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        evidence.read(phc(tmp_path, **change))


# --- HumanML3D


def vectors_263(joints: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """The published vectors of joints (T, 22, 3), y up, whose root is turned about y; by matrices."""
    frames = len(joints)
    cos, sin, zero, one = np.cos(facing), np.sin(facing), np.zeros(frames), np.ones(frames)
    turns = np.moveaxis(np.array([[cos, zero, sin], [zero, one, zero], [-sin, zero, cos]]), -1, 0)
    own = np.swapaxes(turns, 1, 2)  # from the world to the root's axes
    vectors = np.zeros((frames, 263))
    vectors[:-1, 0] = -np.diff(facing) / 2
    steps = (own[1:] @ np.diff(joints[:, 0], axis=0)[..., None])[..., 0]
    vectors[:-1, 1:3] = steps[:, [0, 2]]
    vectors[:, 3] = joints[:, 0, 1]
    flat = joints[:, 1:] - joints[:, :1] * [1, 0, 1]
    vectors[:, 4:67] = (own[:, None] @ flat[..., None])[..., 0].reshape(frames, -1)
    return vectors


def humanml3d(folder: Path, kind: str = "vectors") -> Path:
    joints = walking(22) @ TO_Y_UP.T
    joints = joints - joints[:1, :1] * [1, 0, 1]
    facing = 0.8 * np.sin(np.linspace(0, 2, T))
    np.save(folder / "000001.npy", vectors_263(joints, facing) if kind == "vectors" else joints)
    return folder / "000001.npy"


@pytest.mark.parametrize("kind", ["vectors", "joints"])
def test_humanml3d_gives_its_joints(tmp_path: Path, kind: str) -> None:
    found = evidence.read(humanml3d(tmp_path, kind))
    joints = walking(22)
    np.testing.assert_allclose(found.joints_m, joints - joints[:1, :1] * [1, 1, 0], atol=1e-9)
    assert found.joint_names == smpl_names(22)
    np.testing.assert_allclose(np.diff(found.times_s), 1 / 20)
    assert found.reading.startswith("HumanML3D: ")
    assert found.trust == "mocap"


def test_normalised_vectors_are_refused(tmp_path: Path) -> None:
    values = np.load(humanml3d(tmp_path))
    np.save(tmp_path / "normal.npy", (values - values.mean(axis=0)) / (values.std(axis=0) + 1e-3))
    with pytest.raises(InputError, match=r"a thigh of .* m; valid: vectors as they are published"):
        evidence.read(tmp_path / "normal.npy")
    np.save(tmp_path / "holes.npy", np.where(np.arange(263) == 5, np.nan, values))
    with pytest.raises(InputError, match="12 numbers that are none"):
        evidence.read(tmp_path / "holes.npy")


# --- GEM-X


def soma(folder: Path, body: np.ndarray | None = None) -> Path:
    """A walker's file of the SOMA body: hips, then 76 joints."""
    vectors, place = foreign.poses()
    params = {
        "global_orient": vectors[:, 0],
        "body_pose": np.zeros((T, 228)) if body is None else body,
        "identity_coeffs": np.zeros((T, 45)),
        "scale_params": np.zeros((T, 69)),
        "transl": place,
    }
    tree = {"body_params_global": params, "body_params_incam": params, "K_fullimg": np.tile(LENS, (T, 1, 1))}
    return foreign.save_torch(folder / "hpe_results.pt", tree)


def test_gem_x_poses_the_soma_body(tmp_path: Path) -> None:
    """Its left knee is joint 68 of 77, its second joint of the neck 5, and both are bent here."""
    body = np.zeros((T, 76, 3))
    body[:, 68 - 1] = [0.9, 0.0, 0.0]
    body[:, 5 - 1] = [0.5, 0.0, 0.0]
    found = evidence.read(soma(tmp_path, body.reshape(T, 228)), Options(fps=FPS))
    assert found.reading.startswith("GEM/GENMO: SOMA parameters, frame world, up y")
    assert "neck2" not in found.joint_names
    vectors, place = foreign.poses()
    root = rotations.matrix(rotations.exp(vectors[:, 0]))
    bend, nod = (rotations.matrix(rotations.exp(np.array([x, 0.0, 0.0]))) for x in (0.9, 0.5))
    hip, shank, foot = np.array([0.1193, -0.0897, 0.0253]), [0.0, -0.4350, 0.0], [0.0, -0.4170, 0.0]
    ankle = hip + shank + bend @ foot
    spine = np.sum([[0, 0.0516, 0.0033], [0, 0.0708, -0.0003], [0, 0.0705, -0.0076]], axis=0)
    head = spine + [0, 0.2577, -0.0098] + [0, 0.0595, 0.0178] + nod @ [0, 0.0509, 0.0162]
    for name, own in (("left_ankle", ankle), ("head", head), ("pelvis", np.zeros(3))):
        wanted = foreign.y_to_z(root @ own + place)
        np.testing.assert_allclose(found.joints_m[:, found.joint_names.index(name)], wanted, atol=1e-6)


def test_gem_x_stands_as_tall_as_its_table(tmp_path: Path) -> None:
    found = evidence.read(soma(tmp_path), Options(fps=FPS))
    at = {name: found.joints_m[0, i] for i, name in enumerate(found.joint_names)}
    assert np.linalg.norm(at["left_hip"] - at["left_ankle"]) == pytest.approx(0.852, abs=1e-3)
    assert np.linalg.norm(at["left_wrist"] - at["right_wrist"]) == pytest.approx(2 * 0.6874, abs=1e-3)
