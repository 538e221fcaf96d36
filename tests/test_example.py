"""The example that ships: real, complete, consistent, and with its notice."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from simrecon import evidence, resources, scene
from simrecon.body import names
from simrecon.drawing import video
from simrecon.geometry import camera as cameras

FOLDER = resources.folder("example")

BEAM = scene.read(FOLDER / "beam.toml").items[0]
LENGTH_M, WIDTH_M, HEIGHT_M = (float(str(BEAM.parameters[f"{of}_m"])) for of in ("length", "width", "height"))


def test_all_is_there_and_small() -> None:
    files = {path.name: path.stat().st_size for path in FOLDER.iterdir() if path.name != "__pycache__"}
    assert set(files) == {"beam.npz", "beam.toml", "beam.mp4", "NOTICE"}
    assert sum(files.values()) < 600_000


def test_the_notice_holds_source_and_licence() -> None:
    notice = (FOLDER / "NOTICE").read_text(encoding="utf-8")
    for words in (
        "Pose2Sim",
        "BSD 3-Clause",
        "Copyright (c) 2022, perfanalytics",
        "AS IS",
        "beam.mp4",
        "beam.npz",
    ):
        assert words in notice


def test_evidence_and_video_belong_together() -> None:
    given = evidence.read(FOLDER / "beam.npz")
    evidence.check_names(given, names.valid_names(), "beam.npz")
    assert given.keypoints_px.shape == (100, 33, 2)
    assert given.camera is not None
    width, height = given.camera.lens.image_size_px
    images = list(video.frames(FOLDER / "beam.mp4", given.times_s))
    assert len(images) == 100
    assert images[0].shape[1] / images[0].shape[0] == pytest.approx(width / height, rel=1e-3)
    assert video.rate_hz(given.times_s) == pytest.approx(60)


def test_the_beam_is_the_dark_strip_of_the_video() -> None:
    """The beam's side is darker than the plate to its left, and than its own top, all along."""
    given = evidence.read(FOLDER / "beam.npz")
    camera = given.camera
    assert camera is not None
    beam = scene.read(FOLDER / "beam.toml").items[0]
    assert 0.05 <= HEIGHT_M <= 0.07
    every = given.times_s[::5]
    background = np.median(list(video.frames(FOLDER / "beam.mp4", every)), axis=0)  # without the person
    grey = cv2.cvtColor(background.astype(np.uint8), cv2.COLOR_BGR2GRAY)
    scale = grey.shape[1] / camera.lens.image_size_px[0]

    def brightness(y_m: float, z_m: float) -> float:
        """Mean along the beam's near half, at a distance from the middle of its top."""
        x = beam.position_m[0] + np.linspace(0.0, 0.48, 40) * LENGTH_M
        places = np.stack((x, np.full(40, beam.position_m[1] + y_m), np.full(40, HEIGHT_M + z_m)), -1)
        columns, rows = np.rint(scale * cameras.project(cameras.at(camera, slice(1)), places)).astype(int).T
        return float(grey[rows, columns].mean())

    side = brightness(-WIDTH_M / 2, -0.025)
    assert side < 0.85 * brightness(0.0, 0.0)
    assert side < 0.85 * brightness(-0.15, 0.013 - HEIGHT_M)


def test_the_standing_foot_is_on_the_beam() -> None:
    given = evidence.read(FOLDER / "beam.npz")
    assert given.camera is not None
    beam = scene.read(FOLDER / "beam.toml").items[0]
    toe = given.keypoints_px[:5, given.keypoint_names.index("left_foot_index")].mean(axis=0)
    x = np.linspace(-0.5, 0.5, 400) * LENGTH_M + beam.position_m[0]
    line = np.stack((x, np.full(400, beam.position_m[1]), np.full(400, HEIGHT_M)), axis=-1)
    nearest = np.linalg.norm(cameras.project(cameras.at(given.camera, slice(1)), line) - toe, axis=-1).min()
    assert nearest < 30  # px, about 7 cm there


def test_it_is_the_clip_it_says_it_is(shared_data: Path) -> None:
    ours = evidence.read(FOLDER / "beam.npz")
    source = evidence.read(shared_data / "evidence" / "pose2sim_beam_cam01.npz")
    np.testing.assert_array_equal(ours.keypoints_px, source.keypoints_px)
    np.testing.assert_array_equal(ours.joints_m, source.joints_m)
    film = shared_data / "video" / "pose2sim_beam_cam01.mp4"
    assert (FOLDER / "beam.mp4").read_bytes() == film.read_bytes()
    licence = (shared_data / "video" / "LICENSE.pose2sim").read_text(encoding="utf-8")
    assert licence in (FOLDER / "NOTICE").read_text(encoding="utf-8")
