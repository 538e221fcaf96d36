"""What a camera that nobody knows costs: each clip of a suite with its camera, and with that hidden.

usage: python -m tools.study.unknown_camera SUITE --data DATA -o OUT.json [--clips NAME ...] [--plan NAME]
                                            [--lens]

Prints a line for each clip: how far focal length, floor and stature are off, and the error (mm) with the
first frame aligned, with the camera known, with it hidden, and their ratio. OUT.json keeps what was measured;
fits with the camera known are taken from it. With --lens only the camera's place is hidden.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from simrecon import evidence as readers
from simrecon import kinematics
from simrecon import plan as plans
from simrecon.bench import material, suite
from simrecon.bench.task import BenchmarkTask
from simrecon.body import primitives
from simrecon.evaluation import fitted, scores
from simrecon.geometry import camera as cameras
from simrecon.io import atomic
from simrecon.kinematics import world
from simrecon.types import Array, Camera, Evidence, KinematicFit

ALIGNED = "mpjpe_g_align1_mm"
HEAD = (
    "| clip | focal length | floor (pitch, roll) | stature, hidden / known | known, hidden, ratio |",
    "|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Measured:
    """Of one clip.

    Attributes:
        focal: of the estimate over the true one.
        pitch_deg, roll_deg: error of up, about the image's x axis and about the view.
        stature_m: with the camera hidden, and with it known.
        aligned_mm: with it hidden, and with it known.
    """

    focal: float
    pitch_deg: float
    roll_deg: float
    stature_m: tuple[float, float]
    aligned_mm: tuple[float, float]

    @property
    def floor_deg(self) -> float:
        """Angle between the floor that was found and the real one."""
        return float(np.hypot(self.pitch_deg, self.roll_deg))

    @property
    def ratio(self) -> float:
        """Of the errors."""
        return self.aligned_mm[0] / self.aligned_mm[1]


def measure(task: BenchmarkTask, known: tuple[float, float] | None, *, lens: bool) -> Measured:
    """Fit a clip with its camera hidden, and with it.

    Args:
        task: the clip.
        known: stature and error with the camera, if they were measured before.
        lens: whether the lens is known all the same.
    """
    file, truth = material.files(task)
    plan = plans.read(task.plan)
    evidence = material.read(task, file)
    scene = material.scene(task, evidence, plan)
    seen = readers.resample(evidence)[0]

    def fit(of: Evidence) -> KinematicFit:
        return kinematics.fit(of, scene, plan.kinematics)

    real = seen.camera
    if real is None or real.path is None:
        raise ValueError(f"{task.clip.name}: found no camera with a path")
    if known is None:
        whole = fit(seen)
        known = primitives.upright_m(whole.body), _aligned_mm(whole, truth)
    hidden = replace(seen, camera=Camera(real.lens)) if lens else readers.unknown_camera(seen)
    blind = world.placed(fit(hidden), real)
    found = blind.camera
    if found is None:
        raise ValueError(f"{task.clip.name}: the fit has no camera")
    focal = cameras.focal_px(found.lens) / cameras.focal_px(real.lens)
    pitch, roll = off_deg(found, real)
    tall = primitives.upright_m(blind.body)
    return Measured(focal, pitch, roll, (tall, known[0]), (_aligned_mm(blind, truth), known[1]))


def off_deg(found: Camera, real: Camera) -> tuple[float, float]:
    """Error of up in the camera's frame: about the image's x axis, and about the view."""
    ours, theirs = (cameras.extrinsics(one)[0, :3, 2] for one in (found, real))
    across = np.cross(ours, theirs)  # of length sin, along the axis of the least turn
    angle = float(np.degrees(np.arctan2(np.linalg.norm(across), ours @ theirs)))
    axis: Array = across / max(float(np.linalg.norm(across)), 1e-12)
    pitch = angle * float(axis[0])
    return pitch, float(np.copysign(np.sqrt(max(angle**2 - pitch**2, 0.0)), axis[2]))


def line(name: str, got: Measured) -> str:
    """Of the table."""
    ours, theirs = got.stature_m
    blind, known = got.aligned_mm
    floor = f"{got.floor_deg:.1f}° ({got.pitch_deg:+.1f}, {got.roll_deg:+.1f})"
    error = f"{known:.0f}, {blind:.0f}, {got.ratio:.2f}"
    return f"| {name} | {100 * (got.focal - 1):+.0f} % | {floor} | {ours:.2f} / {theirs:.2f} m | {error} |"


def summary(all_of: list[Measured]) -> str:
    """Below the table."""
    count = len(all_of)
    focal = sum(abs(one.focal - 1) <= 0.15 for one in all_of)
    floor = sum(one.floor_deg <= 3 for one in all_of)
    tall = sum(abs(one.stature_m[0] / one.stature_m[1] - 1) <= 0.05 for one in all_of)
    worse = sum(one.ratio > 1.5 for one in all_of)
    return (
        f"Focal length within 15 % on {focal} of {count}, floor within 3° on {floor}, stature within 5 % on "
        f"{tall}, above 1.5 times the aligned error {worse}."
    )


def _aligned_mm(fit: KinematicFit, truth: Path) -> float:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fit.npz"
        fitted.write(path, fit, 1.0)
        table = scores.score_fit(path, truth, None, seed=None)
    return float(next(iter(table.values.values()))[ALIGNED])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("suite")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--clips", nargs="*")
    parser.add_argument("--plan")
    parser.add_argument("--lens", action="store_true")
    options = parser.parse_args()
    chosen = suite.read(options.suite)
    if options.plan:
        chosen = suite.with_plan(chosen, options.plan)
    before = json.loads(options.output.read_text()) if options.output.is_file() else {}
    print("\n".join(HEAD))
    done: list[Measured] = []
    for clip in chosen.clip:
        if options.clips and clip.name not in options.clips:
            continue
        task = BenchmarkTask(chosen, clip, chosen.variant[0], 0, options.data, options.output.parent)
        kept = before.get(clip.name)
        known = None if kept is None else (kept["stature_m"][1], kept["aligned_mm"][1])
        done.append(measure(task, known, lens=options.lens))
        before[clip.name] = asdict(done[-1])
        atomic.write_json(options.output, before)
        print(line(clip.name, done[-1]), flush=True)
    print("\n" + summary(done))


if __name__ == "__main__":
    main()
