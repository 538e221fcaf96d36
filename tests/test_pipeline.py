"""The whole path of the data, with what only shows there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrecon import evidence as readers
from simrecon import kinematics, pipeline
from simrecon import plan as plans
from simrecon.drawing import overlay
from simrecon.geometry import camera as cameras
from simrecon.pipeline import Reconstruction
from simrecon.replay import SIMULATED
from simrecon.results import report, writing
from simrecon.types import Body, Scene
from tests.support import runs
from tests.support.panning import panning

FRAMES = 16


@pytest.fixture(scope="module")
def body() -> Body:
    return runs.person()


@pytest.fixture(scope="module")
def squats(body: Body, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Reconstruction]:
    """Half a second of a squat, a frame dropped, before a camera that stands and one that pans by 26°."""
    plan = plans.read("quick")
    qpos = runs.squat(body, np.linspace(0.0, 0.6, FRAMES))
    still = runs.camera(FRAMES)
    done = {}
    for name, camera in {"still": still, "panning": panning(still, FRAMES)}.items():
        rng = np.random.default_rng(5)
        evidence = runs.seen(body, qpos, camera)
        path = tmp_path_factory.mktemp(name) / "clip.npz"
        kept = np.delete(np.arange(FRAMES), 6)
        readers.write(
            path,
            replace(
                evidence,
                times_s=evidence.times_s[kept],
                keypoints_px=(evidence.keypoints_px + rng.normal(0, 3, evidence.keypoints_px.shape))[kept],
                scores=evidence.scores[kept],
                joints_m=(evidence.joints_m + rng.normal(0, 0.02, evidence.joints_m.shape))[kept],
                camera=cameras.at(camera, kept),
            ),
        )
        done[name] = pipeline.reconstruct(readers.read(path), Scene(), plan, pipeline.Setup(threads=1))
    return done


def off_m(run: Reconstruction, body: Body) -> float:
    """Mean distance of the simulated points from where they really were."""
    qpos = runs.squat(body, np.linspace(0.0, 0.6, FRAMES))[np.delete(np.arange(FRAMES), 6)]
    true = kinematics.configurations(body, qpos)[1]
    names = body.skeleton.point_names
    columns = [names.index(name) for name in run.motion.joint_names if name in names]
    rows = [i for i, name in enumerate(run.motion.joint_names) if name in names]
    return float(np.linalg.norm(run.motion.joints_m[:, rows] - true[:, columns], axis=-1).mean())


def test_a_panning_camera_costs_a_simulation_no_accuracy(
    squats: dict[str, Reconstruction], body: Body
) -> None:
    still, moving = squats["still"], squats["panning"]
    for run in (still, moving):
        assert (run.motion.status == SIMULATED).all()
        error_px = report.plausibility(run)["mpjpe_2d_px"]
        assert error_px is not None
        assert error_px < 12.0
    assert off_m(moving, body) < 1.1 * off_m(still, body) + 0.002


def test_the_overlay_follows_a_panning_camera(squats: dict[str, Reconstruction]) -> None:
    run = squats["panning"]
    shown = writing.animation(run)
    assert shown.camera is not None
    assert run.evidence.camera is not None
    assert shown.camera.path is not None
    assert run.evidence.camera.path is not None
    np.testing.assert_allclose(shown.camera.path, run.evidence.camera.path, atol=1e-9)
    images = list(overlay.render(shown, [np.zeros((480, 640, 3), np.uint8)] * len(shown.times_s)))
    middle = []
    for frame in (0, len(images) - 1):
        painted = np.argwhere(images[frame].max(axis=-1) > 60)
        painted = painted[painted[:, 0] > 60]  # below the caption
        pixels = run.evidence.keypoints_px[frame]
        assert np.abs(painted.mean(axis=0)[::-1] - pixels.mean(axis=0)).max() < 40
        middle.append(pixels.mean(axis=0))
    assert np.linalg.norm(middle[1] - middle[0]) > 100  # the person crosses the image
