"""Landmarks in space: lifters, FreeMoCap, and what tells their unit, up axis, mirror image and place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrecon import evidence, trust
from simrecon.errors import InputError
from simrecon.evidence import Options
from simrecon.evidence.camera import fov
from simrecon.evidence.keypoints import layouts
from tests.support import foreign_files as foreign
from tests.support import people

ASKED = Options(fps=30.0)
H36M = layouts.layout("h36m_17")
BLAZE = layouts.layout("blazepose_33")
AXES = {  # from a person who faces +x, z up: to the axes of the file
    "z": np.eye(3),
    "y": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "-y": np.array([[0, -1.0, 0], [0, 0, -1], [1, 0, 0]]),
}
H36M_OF_MMPOSE = [
    "root", "right_hip", "right_knee", "right_foot", "left_hip", "left_knee", "left_foot", "spine", "thorax",
    "neck_base", "head", "left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow",
    "right_wrist",
]  # fmt: skip


def around_hips(places: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    hips = [names.index("left_hip"), names.index("right_hip")]
    return places - places[:, hips].mean(axis=1, keepdims=True)


def lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[:, :, None] - joints[:, None], axis=-1)


def handed(found: Any, wanted: np.ndarray) -> None:
    """The same shape and not its mirror image: best turned onto one another, they lie on one another."""
    kept = [i for i, name in enumerate(H36M) if name]
    a = (found.joints_m - found.joints_m.mean(axis=1, keepdims=True)).reshape(-1, 3)
    b = (wanted[:, kept] - wanted[:, kept].mean(axis=1, keepdims=True)).reshape(-1, 3)
    u, _, v = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
    np.testing.assert_allclose(a @ turn, b, atol=1e-6)


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("unit", ["m", "mm"])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_lifters_shape_is_read_whatever_its_axes(
    tmp_path: Path, up: str, unit: str, mirrored: bool
) -> None:
    places = around_hips(people.named(people.walking(), H36M), H36M)
    values = places @ AXES[up].T * (1000.0 if unit == "mm" else 1.0) * ([-1, 1, 1] if mirrored else 1)
    np.save(tmp_path / "lifted.npy", values)
    found = evidence.read(tmp_path / "lifted.npy", ASKED)
    assert found.joints_frame == "camera_root_relative"
    assert f"up axis {up} (" in found.reading
    assert f"unit {unit} (" in found.reading
    assert ("a mirror image" in found.reading) == mirrored
    handed(found, places)
    ahead = (
        found.joints_m[0, found.joint_names.index("left_ankle")]
        - found.joints_m[0, found.joint_names.index("left_hip")]
    )
    assert ahead[1] > 0.5  # y down


def test_a_shape_of_no_unit_is_a_person_of_usual_size(tmp_path: Path) -> None:
    places = around_hips(people.named(people.walking(), H36M), H36M)
    np.save(tmp_path / "lifted.npy", places * 0.21)
    found = evidence.read(tmp_path / "lifted.npy", ASKED)
    assert "unit unknown, taken for a person of 1.7 m" in found.reading
    kept = [i for i, name in enumerate(H36M) if name]
    np.testing.assert_allclose(
        lengths(found.joints_m), lengths(places[:, kept]) * 1.7 / people.STATURE_M, atol=0.01
    )


def mmpose(path: Path, places: np.ndarray, **meta: Any) -> Path:
    """As `Pose3DInferencer` writes it: camera axes, then x turned round, y and z exchanged, feet at zero."""
    camera = around_hips(places, H36M) @ AXES["-y"].T
    values = np.stack((-camera[..., 0], camera[..., 2], -camera[..., 1]), axis=-1)
    values[..., 2] -= values[..., 2].min(axis=1, keepdims=True)
    frames = [
        {"frame_id": t, "instances": [{"keypoints": row.tolist(), "keypoint_scores": [1.0] * 17}]}
        for t, row in enumerate(values)
    ]
    return foreign.save_json(path / "lifted.json", {"meta_info": meta, "instance_info": frames})


@pytest.mark.parametrize("named", [False, True])
def test_mmposes_mirror_image_is_turned_back(tmp_path: Path, named: bool) -> None:
    places = people.named(people.walking(), H36M)
    meta = {"keypoint_id2name": {str(i): name for i, name in enumerate(H36M_OF_MMPOSE)}} if named else {}
    found = evidence.read(mmpose(tmp_path, places, **meta), ASKED)
    assert "a mirror image, by how knees and elbows bend" in found.reading
    assert found.joints_frame == "camera_root_relative"
    handed(found, places)


def test_a_walk_through_space_keeps_its_place(tmp_path: Path) -> None:
    places = people.named(people.walking(speed_mps=1.2), H36M)
    np.save(tmp_path / "walk.npy", places @ AXES["y"].T)
    found = evidence.read(tmp_path / "walk.npy", ASKED)
    assert found.joints_frame == "world"
    np.testing.assert_allclose(found.joints_m, places[:, [i for i, n in enumerate(H36M) if n]], atol=1e-9)
    np.save(tmp_path / "camera.npy", places @ AXES["-y"].T + [0.2, 1.0, 5.0])
    assert evidence.read(tmp_path / "camera.npy", ASKED).joints_frame == "camera"


@pytest.mark.parametrize("count", [33, 75, 543, 553])
def test_freemocaps_arrays_are_read(tmp_path: Path, count: int) -> None:
    places = people.named(people.walking(speed_mps=1.0), BLAZE)
    rest = np.random.default_rng(0).normal(size=(30, count - 33, 3))
    values = 1000.0 * np.concatenate((places, rest), axis=1) + [300.0, -2000.0, 0.0]
    values[3, 5] = np.nan
    np.save(tmp_path / "mediapipe_body_3d_xyz.npy", values)
    found = evidence.read(tmp_path / "mediapipe_body_3d_xyz.npy", ASKED)
    assert found.reading.startswith("FreeMoCap: 33 landmarks in space")
    assert found.joint_names == BLAZE
    assert found.joints_frame == "world"
    known = np.isfinite(found.joints_m)
    np.testing.assert_allclose(found.joints_m[known], (places + np.array([0.3, -2.0, 0.0]))[known], atol=1e-9)
    assert (~known).sum() == 3
    assert trust.of(found).metric
    assert trust.of(found).joints_m == 0.03


def test_blazeposes_other_arrays_are_no_freemocap(tmp_path: Path) -> None:
    points = people.landmarks(BLAZE)
    names = {
        "pixels": (np.concatenate((points, np.full((30, 33, 1), 0.8)), axis=-1), "landmark array"),
        "normalised": (
            np.concatenate((points / [640, 480], np.full((30, 33, 1), -0.2)), axis=-1),
            "landmark array",
        ),
        "five": (np.concatenate((points / [640, 480], np.full((30, 33, 3), 0.9)), axis=-1), "landmark array"),
        "world": (around_hips(people.named(people.walking(), BLAZE), BLAZE) @ AXES["-y"].T, "landmark array"),
    }
    for name, (values, reader) in names.items():
        np.save(tmp_path / f"{name}.npy", values)
        found = evidence.read(
            tmp_path / f"{name}.npy", Options(fps=30.0, camera=fov.pinhole(800.0, (640, 480)))
        )
        assert found.reading.startswith(f"{reader}: ")
        assert bool(found.joint_names) == (name == "world")
        if name != "world":
            np.testing.assert_allclose(found.keypoints_px, points, atol=1e-6)
        if name == "five":
            np.testing.assert_allclose(found.scores, 0.81)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: p[..., [2, 0, 1]], "up axis: found a person who is upright along x"),
        (lambda p: p * 17.0, "unit: found a person about"),
        (lambda p: p * np.nan, "people: found no person"),
        (lambda p: np.random.default_rng(1).normal(size=p.shape), "no person in the order of"),
    ],
)
def test_what_is_no_walk_of_a_person_is_refused(tmp_path: Path, make: Any, words: str) -> None:
    np.save(tmp_path / "walk.npy", make(people.named(people.walking(speed_mps=1.2), H36M)))
    with pytest.raises(InputError) as raised:
        evidence.read(tmp_path / "walk.npy", ASKED)
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)
