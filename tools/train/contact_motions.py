"""Motions for the training of contacts: recordings on simrecon's body, and when which part of it touches.

Every recording is fitted as motion capture is (`kinematics.fit`), which gives landmarks, primitives and the
floor. It is kept at 30 Hz and interpolated to any rate; a person of another size is the same motion, scaled.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from simrecon import evidence as readers
from simrecon import kinematics
from simrecon import plan as plans
from simrecon.body import names
from simrecon.contact import rules
from simrecon.contact.parts import SIDES
from simrecon.evidence import cutting, resample
from simrecon.io import toml
from simrecon.kinematics.touched import touched
from simrecon.types import Array, Evidence, Flags, KinematicFit, Scene
from tools.bench import references

RATE_HZ = 30.0
SPLIT = Path(__file__).with_name("contact_split.toml")
HEURISTIC_M, HEURISTIC_MPS = 0.05 + 0.03, 0.02 * 30
"""Rempe 2020, section 3.2: within 5 cm of the ground, and less than 2 cm a frame at 30 Hz.

The heights of the retargeted recordings drift by up to 4 cm from step to step, so 3 cm are added.
"""
FEET = ("left_heel", "right_heel", "left_mtp", "right_mtp")
"""Joints of the first parts: heels and bases of the toes, as in the paper."""
UNEVEN = ("cmu_01", "cmu_03")
"""Subjects that climb, or walk over uneven terrain: what they stand on is not known."""


@dataclass(frozen=True, eq=False)
class ContactMotion:
    """A motion at `RATE_HZ`; T frames, M points of the body, P parts.

    Attributes:
        name: of the recording, by which it belongs to a part of the split.
        points_m: (T, M, 3) in the world.
        clearance_m: (T, P) of the parts; speed_mps: (T, P).
        pushed: (T, P) which parts the scene pushes, in a motion that was simulated; else None.
    """

    name: str
    points_m: Array
    clearance_m: Array
    speed_mps: Array
    pushed: Flags | None = None

    @property
    def touches(self) -> Flags:
        """Which parts touch, (T, P): those that are pushed, where forces are known, else by the heuristic."""
        return self.heuristic if self.pushed is None else self.pushed

    @property
    def heuristic(self) -> Flags:
        """Which parts touch, (T, P): feet by that of Rempe 2020, others within 2 cm of the scene."""
        feet = np.stack([self._rests(point) for point in FEET], axis=1)
        return np.concatenate((feet, rules.near(self.clearance_m[:, len(FEET) :])), axis=1)

    def _rests(self, point: str) -> Flags:
        """Whether a joint is near the height at which it and its other side rest, and slow, (T,)."""
        height = self.points_m[:, names.resolve([point])[0], 2]
        sides = self.points_m[:, names.resolve([f"{side}_{point.split('_')[1]}" for side in SIDES]), 2]
        step = np.linalg.norm(np.diff(self.points_m[:, names.resolve([point])[0]], axis=0), axis=-1)
        speed = np.concatenate((step[:1], step)) * RATE_HZ
        return np.asarray((height < rules.rest_height_m(sides) + HEURISTIC_M) & (speed < HEURISTIC_MPS))


def part_of(name: str) -> str:
    """`test`, `validation` or `train`; motions by formula have it in their name."""
    if name.startswith("grounded_"):
        return name.split("_")[1]
    held = _split()
    return next((part for part in ("test", "validation") if name in held[part]), "train")


@cache
def _split() -> dict[str, list[str]]:
    return toml.load(SPLIT)


def load(mocap: Path, cmu: Path, cache_folder: Path) -> list[ContactMotion]:
    """All motions, fitted once and kept in a folder.

    Args:
        mocap: folder of `deepmimic`, `mass_bvh` and `mjpc_keyframes`.
        cmu: folder with the unpacked CMU archive.
        cache_folder: where fitted motions are kept.
    """
    cache_folder.mkdir(parents=True, exist_ok=True)
    motions = []
    for name, motion in recordings(mocap, cmu):
        path = cache_folder / f"{name}.npz"
        if not path.is_file():
            _fit(motion, path)
        with np.load(path, allow_pickle=False) as kept:
            motions.append(ContactMotion(name, kept["points_m"], kept["clearance_m"], kept["speed_mps"]))
    return motions


def _fit(motion: Evidence | KinematicFit, path: Path) -> None:
    if isinstance(motion, KinematicFit):
        fit = motion
    else:
        fit = kinematics.fit(resample(motion)[0], Scene(), plans.read("quick").kinematics)
    found = touched(fit.body, fit.scene, fit.qpos, fit.times_s)
    points = kinematics.configurations(fit.body, fit.qpos)[1]
    points[..., 2] -= fit.scene.ground.height_m
    np.savez(path, points_m=points, clearance_m=found.clearance_m, speed_mps=found.speed_mps)


def recordings(mocap: Path, cmu: Path) -> Iterator[tuple[str, Evidence | KinematicFit]]:
    """Every recording on even ground once, by name and at about 30 Hz; arguments as of `load`."""
    seen = set()
    for path in sorted(cmu.glob("cmu_bvh/**/*.bvh")):
        subject, number = re.findall(r"\d+", path.stem)[:2]
        name = f"cmu_{int(subject):02d}_{int(number):02d}"
        seen.add(name)
        if name.startswith(UNEVEN):
            continue
        yield name, _thinned(readers.read(path))
    for path in sorted((mocap / "mass_bvh").glob("*.bvh")):
        yield f"mass_{path.stem}", _thinned(readers.read(path))
    for path in sorted((mocap / "mjpc_keyframes").glob("CMU-*.xml")):
        subject, number = path.stem.split("-")[-1].split("_")[:2]
        name = f"cmu_{int(subject):02d}_{int(number):02d}"
        if name not in seen:
            yield name, _keyframes(path, mocap / "mjpc_keyframes" / "task.xml")
    for path in sorted((mocap / "deepmimic").glob("humanoid3d_*.txt")):
        name = path.stem.removeprefix("humanoid3d_")
        yield f"deepmimic_{name}", references.read(mocap / "deepmimic", name)


def _thinned(evidence: Evidence) -> Evidence:
    """Every so many frames, so that the rate comes near `RATE_HZ`."""
    rate = (len(evidence.times_s) - 1) / float(evidence.times_s[-1] - evidence.times_s[0])
    return cutting.cut(evidence, slice(None, None, max(1, round(rate / RATE_HZ))))


def _of_joints(names: tuple[str, ...], joints_m: Array, rate_hz: float) -> Evidence:
    frames = len(joints_m)
    return Evidence(
        times_s=np.arange(frames) / rate_hz,
        keypoint_names=(),
        keypoints_px=np.empty((frames, 0, 2)),
        scores=np.empty((frames, 0)),
        joint_names=names,
        joints_m=joints_m,
        joints_frame="world",
        trust="mocap",
    )


def _keyframes(path: Path, task: Path) -> Evidence:
    """CMU's acrobatics as 16 points by frame (MuJoCo MPC)."""
    found = re.findall(r'<body name="mocap\[(\w+)\]" mocap', task.read_text())
    sides = {"l": "left", "r": "right"}
    points = tuple(
        name if name in ("pelvis", "head") else f"{sides[name[0]]}_{name[1:].replace('hand', 'wrist')}"
        for name in found
    )
    rows = re.findall(r'mpos="([^"]+)"', path.read_text())
    joints = np.array([row.split() for row in rows], float).reshape(len(rows), -1, 3)
    return _of_joints(points, joints, RATE_HZ)
