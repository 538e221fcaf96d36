"""Gaussian, mixture and flow side by side, the flow's timing, and samples of it.

usage: python -m tools.train.compare_priors MOCAP [--picture FILE.png]        (needs the extra [train])

A mixture's latent code is that of its nearest component, with the component's weight and volume counted in:
‖z‖² = −2 log p(v) up to a constant that makes the least value in the training poses zero.
"""

from __future__ import annotations

import argparse
import json
import tarfile
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import mujoco
import numpy as np
from sklearn.mixture import GaussianMixture

from simrecon import body as bodies
from simrecon import kinematics, prior
from simrecon import scene as scenes
from simrecon.drawing.animation import Animation
from simrecon.drawing.overlay import contact_sheet
from simrecon.drawing.painter import Painter
from simrecon.drawing.stage import upright
from simrecon.drawing.views import View, three_quarter
from simrecon.geometry import rotations
from simrecon.types import Array, Scene
from tools.train.prior_data import Poses, load, mirrored
from tools.train.prior_score import report

COMPONENTS, NOISE_RAD = 32, 0.08


def main() -> None:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description="Compare pose priors.")
    parser.add_argument("mocap", type=Path, help="folder of the recordings")
    parser.add_argument("--picture", type=Path, help="PNG of twelve samples of the flow")
    options = parser.parse_args()
    if options.picture:
        samples(options.picture)
    timing()
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(options.mocap / "cmu_asf_amc_bvh.tar.xz") as archive:
            archive.extractall(folder, filter="data")
        data = load(options.mocap, Path(folder))
    usual, learned = prior.gaussian(bodies.template()), prior.flow()
    for name, norm in {
        "gaussian, as shipped": lambda v: np.sqrt(usual.squared(v)[0]),
        "gaussian, full covariance": mixture(data["train"], 1),
        f"mixture of {COMPONENTS}": mixture(data["train"], COMPONENTS),
        "flow": lambda v: np.linalg.norm(learned.code(v), axis=-1),
    }.items():
        print(name, json.dumps(report(norm, data)), flush=True)


def mixture(train: Poses, components: int) -> Callable[[Array], Array]:
    """√(−2 log p + c) of a mixture of Gaussians of poses with noise and their mirror images."""
    rng = np.random.default_rng(0)
    rows = rng.choice(len(train.rotvecs), 8_000, p=train.weights)
    poses = np.concatenate((train.rotvecs[rows], mirrored(train.rotvecs[rows])))
    poses = (poses + rng.normal(0, NOISE_RAD, poses.shape)).reshape(-1, 48)
    fitted = GaussianMixture(components, reg_covar=1e-4, random_state=0, max_iter=30).fit(poses)
    best = float(fitted.score_samples(train.rotvecs.reshape(-1, 48)).max())
    return lambda v: np.sqrt(np.maximum(2 * (best - fitted.score_samples(v.reshape(-1, 48))), 0.0))


def timing() -> None:
    """64 samples × 30 frames, latent codes of quaternions: processor time, and what was waited."""
    learned = prior.flow()
    q = rotations.exp(learned.sample(np.random.default_rng(0), 64 * 30)).reshape(64, 30, 16, 4)
    for threads in (1, 2):
        spent = []
        for _ in range(200):
            begin = time.process_time(), time.perf_counter()
            learned.latent(q, threads)
            spent.append((time.process_time() - begin[0], time.perf_counter() - begin[1]))
        best, middle = 1e3 * np.min(spent, axis=0), 1e3 * np.median(spent, axis=0)
        print(f"64 x 30 poses, {threads} threads: {best[0]:.2f} ms of processor time at best, "
              f"{middle[0]:.2f} at the median; {best[1]:.2f} ms waited at best")  # fmt: skip


def samples(path: Path, count: int = 12) -> None:
    """Random poses of the flow, pelvis upright, lowest point on the floor."""
    person = upright()
    sampled = prior.flow().sample(np.random.default_rng(1), count)
    qpos = np.zeros((count, 7 + 4 * 16))
    qpos[:, 3] = 1.0
    qpos[:, 7:] = rotations.exp(sampled).reshape(count, -1)
    lowest = kinematics.configurations(person, qpos)[1][..., 2].min(axis=1)
    qpos[:, 2] = 0.03 - lowest
    model = mujoco.MjModel.from_xml_string(scenes.build(person.mjcf, Scene(), 0.01))
    reach = np.array([0.75, 0.75, 0.0])
    camera = three_quarter(-reach, reach + np.array([0.0, 0.0, 1.75]), 0.0)
    clip = Animation(
        model=model, times_s=np.zeros(count), qpos=qpos, camera=camera, ground_m=np.zeros((1, 2))
    )
    width, height = camera.lens.image_size_px
    view = View(np.zeros(2), np.full(2, 0.45), (round(0.45 * width), round(0.45 * height)))
    norms = np.sqrt(prior.flow().squared(sampled)[0])
    painter = Painter(clip)
    images = [painter.draw(i, view, None, f"|z| = {norms[i]:.1f}") for i in range(count)]
    cv2.imwrite(str(path), contact_sheet(images, 4))


if __name__ == "__main__":
    main()
