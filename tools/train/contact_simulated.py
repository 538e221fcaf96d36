"""Motions that were really simulated, for the training of contacts: a part touches if the scene pushes it.

usage: python -m tools.train.contact_simulated MOCAP CMU --work DIR

MOCAP and CMU are as of `tools.train.contacts`, which reads what this makes. Of each recording some seconds
from its middle are simulated by the plan `quick` straight from its joints, as are the motions by formula of
`contact_grounded`. What is there is kept, so the same command goes on where it was stopped. A motion is
kept up to where its simulation leaves the recording: from there on it says nothing of it.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

import simrecon
from simrecon import evidence as readers
from simrecon import kinematics
from simrecon import plan as plans
from simrecon.errors import SimreconError
from simrecon.io import atomic
from simrecon.pipeline import Reconstruction, Setup
from simrecon.results import contacts
from simrecon.types import Array, Evidence, KinematicFit, Scene
from tools.train import contact_grounded, contact_motions
from tools.train.contact_motions import ContactMotion

SECONDS, LEAST_FRAMES = 4.0, 15
PLAN = "quick"
TRUST = "mocap,assume=1,joints_m=0.05,place_m=0.05"
"""Of recordings, which may be left by centimetres, so that feet that stand are level and on the floor."""
NEAR_M = 0.15
"""Mean distance from its reference up to which a simulated frame shows the motion it is named after."""


def main() -> None:
    """Simulate what is not there yet, one line for each motion."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("mocap", type=Path)
    parser.add_argument("cmu", type=Path)
    parser.add_argument("--work", type=Path, required=True)
    options = parser.parse_args()
    make(options.mocap, options.cmu, options.work)


def make(mocap: Path, cmu: Path, work: Path) -> None:
    """Simulate what is not there yet into `work/simulated`; arguments as of `main`."""
    folder = work / "simulated"
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in _motions(mocap, cmu):
        path = folder / f"{name}.npz"
        if path.is_file():
            continue
        evidence, scene = draw()
        try:
            kept, said = _arrays(_simulated(evidence, scene))
        except SimreconError as error:
            print(f"{name}: {error}", flush=True)
            continue
        atomic.write_npz(path, kept)
        print(f"{name}: {said}", flush=True)


def load(work: Path) -> list[ContactMotion]:
    """The motions that `make` has simulated."""
    motions = []
    for path in sorted((work / "simulated").glob("*.npz")):
        with np.load(path, allow_pickle=False) as kept:
            if int(kept["frames"]) < LEAST_FRAMES:
                continue
            arrays = (kept[key] for key in ("points_m", "clearance_m", "speed_mps", "pushed"))
            motions.append(ContactMotion(path.stem, *arrays))
    return motions


def _motions(mocap: Path, cmu: Path) -> Iterator[tuple[str, Callable[[], tuple[Evidence, Scene]]]]:
    """By name, what gives the joints that are simulated, and the scene."""
    yield from contact_grounded.motions()
    for name, motion in contact_motions.recordings(mocap, cmu):
        yield name, partial(_middle, name, motion)


def _middle(name: str, motion: Evidence | KinematicFit) -> tuple[Evidence, Scene]:
    """Seconds from the middle of a recording, on a floor."""
    whole = _of_fit(motion) if isinstance(motion, KinematicFit) else motion
    first, last = float(whole.times_s[0]), float(whole.times_s[-1])
    begin = first + max(0.0, (last - first - SECONDS) / 2)
    part = readers.within(whole, readers.Span(begin, begin + SECONDS), name)
    return replace(part, times_s=part.times_s - part.times_s[0], trust=TRUST, part=None), Scene()


def _of_fit(fit: KinematicFit) -> Evidence:
    return readers.from_arrays(
        fit.times_s,
        joint_names=fit.body.skeleton.point_names,
        joints_m=kinematics.configurations(fit.body, fit.qpos)[1],
        joints_frame="world",
        height_m=fit.body.height_m,
        mass_kg=fit.body.mass_kg,
    )


def _simulated(evidence: Evidence, scene: Scene) -> Reconstruction:
    plan = plans.read(PLAN)
    return simrecon.reconstruct(evidence, scene, plan, Setup(planner=plan.planner, threads=1))


def _arrays(run: Reconstruction) -> tuple[dict[str, Array], str]:
    """What is kept of a simulated motion, at `contact_motions.RATE_HZ`, and a word about it."""
    fit, motion = run.fit, run.motion
    found = contacts.of_motion(fit.body, fit.scene, motion)
    count = 3 + 4 * len(fit.body.skeleton.names)
    points = kinematics.configurations(fit.body, motion.qpos[:, :count])[1]
    at = np.abs(motion.times_s[:, None] - fit.times_s).argmin(axis=1)
    wanted = kinematics.configurations(fit.body, fit.qpos)[1][at]
    off = np.linalg.norm(points - wanted, axis=-1).mean(axis=1)
    good = motion.kept & (off < NEAR_M)
    frames = len(good) if good.all() else int(np.argmin(good))
    points[..., 2] -= fit.scene.ground.height_m
    pushed = contacts.pushes(motion, found)
    kept = {
        "frames": np.array(frames),
        "rate_hz": np.array(1.0 / float(np.median(np.diff(motion.times_s)))),
        "points_m": points[:frames].astype(np.float32),
        "clearance_m": found.clearance_m[:frames].astype(np.float32),
        "speed_mps": found.speed_mps[:frames].astype(np.float32),
        "pushed": pushed[:frames],
    }
    share = " ".join(f"{100 * value:.0f}" for value in pushed[:frames].mean(axis=0)) if frames else "-"
    said = f"{frames} of {len(good)} frames, {1e3 * off[:frames].mean():.0f} mm off, pushed {share} %"
    return kept, f"{said}, {run.cpu_s:.0f} s"


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
