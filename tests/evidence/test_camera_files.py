from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from simrecon.errors import InputError
from simrecon.evidence.camera import calibration, files
from simrecon.geometry import camera as cameras
from simrecon.types import Array

K = np.array([[900.0, 0, 500], [0, 910, 400], [0, 0, 1]])
DISTORTION = [0.1, -0.05, 0.001, -0.002, 0.01]
# A camera at (0, -4, 1.5) that looks along +y, a little down: world z up.
TILT = np.radians(10)
ROTATION = np.array(
    [[1, 0, 0], [0, -np.sin(TILT), -np.cos(TILT)], [0, np.cos(TILT), -np.sin(TILT)]]
)  # rows: image right, image down, forward
CENTRE = np.array([0.0, -4.0, 1.5])
TRANSLATION = -ROTATION @ CENTRE


def section(name: str, *, matrix: Array = K, rotation: Array = ROTATION, extra: str = "") -> str:
    vector = cv2.Rodrigues(np.asarray(rotation, float))[0].ravel().tolist()
    translation = (-np.asarray(rotation) @ CENTRE).tolist()
    return (
        f'[{name}]\nname = "{name}"\nsize = [1000.0, 800.0]\nmatrix = {matrix.tolist()}\n'
        f"distortions = {DISTORTION[:4]}\nrotation = {vector}\ntranslation = {translation}\n{extra}\n"
    )


def written(folder: Path, text: str, name: str = "camera.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_pose2sim(tmp_path: Path) -> None:
    text = (
        section("cam_01") + section("cam_02", matrix=K * [[2], [2], [1]]) + "[metadata]\nadjusted = false\n"
    )
    path = written(tmp_path, text, "Calib_scene.toml")
    found, how = files.read(path, name="cam_02")
    np.testing.assert_allclose(found.lens.matrix_px, K * [[2], [2], [1]])
    np.testing.assert_allclose(found.lens.distortion, [*DISTORTION[:4], 0])
    assert found.lens.image_size_px == (1000, 800)
    np.testing.assert_allclose(cameras.centre_m(found)[0], CENTRE, atol=1e-9)
    assert how == "Calib_scene.toml, camera cam_02, focal length 1810 px, with its pose, world z up"
    by_name, how = files.read(path, hint="clips/walk_cam02.mp4")
    np.testing.assert_allclose(by_name.lens.matrix_px, found.lens.matrix_px)
    assert "cam_02 (by the video's name)" in how
    with pytest.raises(InputError, match="found 2 cameras; valid: --camera-name with one of cam_01, cam_02"):
        files.read(path, hint="walk.mp4")
    with pytest.raises(InputError, match="--camera-name: found 'cam_9'; valid: cam_01, cam_02"):
        files.read(path, name="cam_9")


@pytest.mark.parametrize("nested", [False, True])
def test_caliscope(tmp_path: Path, nested: bool) -> None:
    text = section("cam_0", extra="port = 0\nrotation_count = 0\nignore = false\n").replace(
        'name = "cam_0"\n', ""
    )
    text += section("cam_1", extra="ignore = true\n")
    found, _ = files.read(written(tmp_path, text.replace("[cam", "[cameras.cam") if nested else text))
    np.testing.assert_allclose(cameras.centre_m(found)[0], CENTRE, atol=1e-9)


def test_a_world_with_another_up_axis_is_asked_for(tmp_path: Path) -> None:
    turned = ROTATION @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # of a world with y up
    path = written(tmp_path, section("cam", rotation=turned))
    with pytest.raises(
        InputError, match="up axis: found a camera whose image is upright along y; valid: --up"
    ):
        files.read(path)
    found, how = files.read(path, up="y")
    assert found.path is not None
    np.testing.assert_allclose(found.path[0, :3, :3], ROTATION, atol=1e-9)
    assert "world y up" in how


def test_own_file(tmp_path: Path) -> None:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = ROTATION, TRANSLATION
    text = f"image_size_px = [1000, 800]\nfocal_px = 900\nworld_to_camera = {pose.tolist()}\n"
    found, how = files.read(written(tmp_path, text))
    np.testing.assert_allclose(found.lens.matrix_px, [[900, 0, 499.5], [0, 900, 399.5], [0, 0, 1.0]])
    assert found.path is not None
    np.testing.assert_allclose(found.path, [pose])
    assert "with its pose" in how
    plain, how = files.read(written(tmp_path, f"image_size_px = [1000, 800]\nmatrix_px = {K.tolist()}\n"))
    assert plain.path is None
    assert "the floor is estimated" in how


@pytest.mark.parametrize("suffix", ["yml", "xml"])
def test_opencv(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"camera.{suffix}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 1000)
    storage.write("image_height", 800)
    storage.write("camera_matrix", K)
    storage.write("distortion_coefficients", np.array(DISTORTION)[:, None])
    storage.write("rvec", cv2.Rodrigues(ROTATION)[0])
    storage.write("tvec", TRANSLATION)
    storage.release()
    found, _ = files.read(path)
    np.testing.assert_allclose(found.lens.matrix_px, K)
    np.testing.assert_allclose(found.lens.distortion, DISTORTION)
    assert found.lens.image_size_px == (1000, 800)
    np.testing.assert_allclose(cameras.centre_m(found)[0], CENTRE, atol=1e-9)


def test_ros_yaml(tmp_path: Path) -> None:
    text = (
        "image_width: 1000\nimage_height: 800\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
        f"  data: {K.ravel().tolist()}\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
        f"  data: {DISTORTION}\n"
    )
    found, _ = files.read(written(tmp_path, text, "left.yaml"))
    np.testing.assert_allclose(found.lens.matrix_px, K)
    np.testing.assert_allclose(found.lens.distortion, DISTORTION)
    assert found.lens.image_size_px == (1000, 800)


def test_scaled_to_the_video(tmp_path: Path) -> None:
    path = written(tmp_path, section("cam"))
    found, how = files.read(path, size_px=(500, 400))
    assert "scaled by 0.5 from 1000 x 800" in how
    ray = np.array([0.2, -0.1])
    whole, _ = files.read(path)
    big, small = cameras.distort(whole.lens, ray), cameras.distort(found.lens, ray)
    np.testing.assert_allclose(small + 0.5, (big + 0.5) / 2)
    with pytest.raises(InputError, match=r"1000 x 800 px for images of 800 x 1000 \(a turned camera\?\)"):
        files.read(path, size_px=(800, 1000))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("image_size_px = [1000, 800]\n", "focal_px: found no such key"),
        ("image_size_px = [1000, 800]\nfocal_px = 900\nfoval = 3\n", "foval: found an unknown key"),
        ("image_size_px = [1000, 800]\nfocal_px = -9\n", "focal_px: found .*; valid: .*fx, 0, cx"),
        (section("cam", extra="fisheye = true"), "fisheye: found true; valid: a camera without fisheye"),
        (section("cam").replace("matrix = [[900.0", "matrix = [[nan"), "matrix: found 1 NaN"),
        ("what = [", "found no camera file"),
        ("what = " + 5000 * "[", "found no camera file"),
        ("%YAML:1.0\n---\nother: 3\n", "camera matrix: found none; valid: a key of camera_matrix"),
        ("%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n", "camera|damaged"),
    ],
)
def test_broken_files(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        files.read(written(tmp_path, text))
    assert "camera.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        files.read(tmp_path / "none.toml")


def test_a_rotation_beyond_all_sense_is_refused(tmp_path: Path) -> None:
    for rotation in (np.full(3, 1e308), np.diag([1e200, 1.0, 1.0])):
        with pytest.raises(InputError, match="found a rotation of 1e"):
            calibration.rigid(tmp_path / "a.toml", "cam.rotation", rotation, np.zeros(3))
