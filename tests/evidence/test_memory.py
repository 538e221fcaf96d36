"""Evidence made in memory: what does not fit together is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrecon import evidence as readers
from simrecon.errors import InputError
from simrecon.evidence import from_arrays, resample
from simrecon.geometry import camera as cameras
from simrecon.types import Array, Camera, Evidence, Lens

T = 4
LENS = Lens(np.array([[900.0, 0, 320], [0, 900.0, 240], [0, 0, 1]]), np.zeros(5), (640, 480))


def seen(camera: Camera | None = None) -> Evidence:
    return from_arrays(
        np.arange(T) / 30.0,
        joint_names=("left_hip", "right_hip"),
        joints_m=np.arange(T * 6.0).reshape(T, 2, 3) / 10,
        camera=camera,
    )


def path(frames: int, moving: bool) -> Array:
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, 0, 3] = np.arange(frames) * moving
    return poses


@pytest.mark.parametrize(("frames", "moving"), [(T - 1, True), (T + 1, True), (0, False)])
def test_a_path_has_a_transform_for_each_frame(frames: int, moving: bool, tmp_path: Path) -> None:
    camera = Camera(LENS, path(frames, moving))
    with pytest.raises(InputError, match="world_to_camera"):
        seen(camera)
    with pytest.raises(InputError, match="world_to_camera"):
        readers.write(tmp_path / "seen.npz", cameras_of(seen(), camera))
    with pytest.raises(InputError, match=r"the camera's path: found an array of shape"):
        resample(cameras_of(seen(), camera))


def cameras_of(evidence: Evidence, camera: Camera) -> Evidence:
    return replace(evidence, camera=camera)


def test_one_transform_stands_for_all_frames() -> None:
    camera = seen(Camera(LENS, path(1, False))).camera
    assert camera is not None
    assert camera.path is not None
    assert camera.path.shape == (T, 4, 4)
    assert cameras.is_still(camera)


def test_points_without_names_are_not_dropped() -> None:
    times_s = np.arange(T) / 30.0
    with pytest.raises(InputError, match="joint_names: found no names"):
        from_arrays(times_s, joints_m=np.zeros((T, 2, 3)))
    with pytest.raises(InputError, match="keypoint_names: found no names"):
        from_arrays(times_s, keypoints_px=np.zeros((T, 2, 2)))
