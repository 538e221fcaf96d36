"""Where the camera stands, by a file that has the person in the world and before the camera."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from simrecon import cli, evidence
from simrecon.drawing import overlay
from simrecon.evidence import Options
from simrecon.evidence.camera import fov
from simrecon.evidence.smpl import motion as smpl
from simrecon.geometry import camera as cameras
from tests.evidence import test_smpl as files
from tests.support import foreign_files as foreign
from tests.support.reading import observed
from tools import CHECKOUT

SIZE = (540, 960)
SAID = Options(fps=30.0, camera=fov.from_fov(37.0, SIZE))


def standing(write: object, folder: Path, model: str) -> Path:
    """A file of a camera that stands still before the person."""
    vectors, place = foreign.poses(joints=24)
    _, _, seen, there = foreign.carried(vectors, place, smpl.offsets_m(model)[0], pan_rad=0.0, move_m=0.0)
    if write is files.wham:
        change = {"pose": seen.reshape(-1, 72), "trans": there, "pose_world": vectors.reshape(-1, 72)}
        return files.wham(folder, **change, trans_world=place)
    params = [
        {"body_pose": v[:, 1:22].reshape(-1, 63), "global_orient": v[:, 0], "transl": t}
        for v, t in ((vectors, place), (seen, there))
    ]
    tree = {"smpl_params_global": params[0], "smpl_params_incam": params[1], "K_fullimg": files.K[None]}
    return foreign.save_torch(folder / "hmr4d_results.pt", tree)


@pytest.mark.parametrize(("write", "model"), [(files.wham, "smpl"), (files.gvhmr, "smplx")])
def test_a_camera_that_stands_is_placed_by_both_motions(tmp_path: Path, write: object, model: str) -> None:
    path = standing(write, tmp_path, model)
    found = evidence.read(path, SAID if write is files.wham else Options(fps=30.0))
    assert "the camera stands where both motions in the file have it" in found.reading
    assert found.camera is not None
    assert cameras.is_still(found.camera)
    assert not found.ground_known
    own = evidence.read(path, replace(SAID, frame="camera")).joints_m
    np.testing.assert_allclose(cameras.to_camera(found.camera, found.joints_m), own, atol=1e-6)
    assert overlay.is_placed(found)


def test_landmarks_place_it_where_there_are_any(tmp_path: Path) -> None:
    path = standing(files.wham, tmp_path, "smpl")
    found = evidence.read(path, replace(SAID, landmarks=True))
    assert found.camera is not None
    assert found.camera.path is None
    assert found.ground_known


def test_without_a_lens_wham_has_the_one_that_it_takes_for_granted(tmp_path: Path) -> None:
    path = standing(files.wham, tmp_path, "smpl")
    found = evidence.read(path, Options(fps=30.0, size_px=SIZE))
    assert found.camera is not None
    assert cameras.focal_px(found.camera.lens) == pytest.approx(np.hypot(*SIZE))
    assert "the lens that WHAM takes for granted, 1101 px" in found.reading
    assert evidence.read(path, Options(fps=30.0)).camera is None


def test_a_motion_that_is_not_before_the_camera_places_nothing(tmp_path: Path) -> None:
    """Both motions are the same here: the person is where the camera is."""
    vectors, place = foreign.poses()
    place = place * [1.0, 1.0, 0.0]
    same = {"pose": vectors.reshape(-1, 72), "trans": place, "pose_world": vectors.reshape(-1, 72)}
    found = evidence.read(files.wham(tmp_path, **same, trans_world=place), SAID)
    assert found.camera is not None
    assert found.camera.path is None
    assert "where the camera stands is not known (" in found.reading
    assert not overlay.is_placed(found)


def test_the_case_of_both_motions_at_one_place_runs() -> None:
    """The README's line, without and with a lens: the reading says that nothing places the camera."""
    case = CHECKOUT / "tests" / "data" / "cases"
    for words in ((), ("--fov", "37")):
        seen = observed(case / "wham_output.pkl", "--video", str(case / "any_video.mp4"), *words)
        assert seen.camera is not None
        assert not overlay.is_placed(seen)
        assert "where the camera stands is not known" in seen.reading


@pytest.mark.slow
def test_its_picture_shows_the_body(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = CHECKOUT / "tests" / "data" / "cases"
    words = ["--video", str(case / "any_video.mp4"), "--fov", "37", "--plan", "quick", "--threads", "1"]
    assert cli.main(["run", str(case / "wham_output.pkl"), "-o", str(tmp_path / "out"), *words]) == 0
    assert "no video is drawn on" in capsys.readouterr().err
    page = cv2.imread(str(tmp_path / "out" / "overlay.png"))
    assert page is not None
    blue, green, red = np.moveaxis(page.astype(int), -1, 0)
    assert ((red > green + 20) & (green > blue + 10)).mean() > 0.005  # left limbs are orange


def test_a_camera_of_tram_stands_where_the_file_has_it(tmp_path: Path) -> None:
    """Two metres before the person, who is in its frame at (0.3, 0.9, 2.0) and on."""
    turn = np.diag([1.0, -1.0, -1.0])
    files.tram_camera(
        tmp_path, np.tile(turn, (foreign.T, 1, 1)), np.tile([0.5, 1.0, 3.0], (foreign.T, 1)), world=True
    )
    path = files.tram(tmp_path)
    found = evidence.read(path, Options(fps=30.0, up="y"))
    assert "the camera stands still, it stands where the file has it" in found.reading
    assert found.camera is not None
    np.testing.assert_allclose(
        cameras.centre_m(found.camera)[0], foreign.y_to_z(np.array([0.5, 1.0, 3.0])), atol=1e-9
    )
    assert (cameras.to_camera(found.camera, found.joints_m)[..., 2] > 0).all()
    told = evidence.read(path, Options(fps=30.0, up="y", landmarks=True))
    assert told.camera is not None
    assert told.camera.path is None


def test_a_camera_of_prompthmr_behind_the_person_is_not_believed(tmp_path: Path) -> None:
    found = evidence.read(files.prompthmr(tmp_path), Options(fps=30.0))
    assert found.camera is not None
    assert (found.camera.path is None) == ("where it stands is not known" in found.reading)
