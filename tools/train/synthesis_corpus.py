"""The corpus of the synthesis: its split, and truth, kinematic fit and simulation of a clip side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import kinematics, results
from simrecon.errors import InputError
from simrecon.io import atomic, tables
from simrecon.io.messages import counted
from simrecon.types import Array, Flags

SPLIT = Path(__file__).with_name("synthesis_split.toml")
KINDS = ("truth", "simulation", "fit")
"""What a model is trained on: (a), (b) and (c) of Xie 2021, table 5."""


@dataclass(frozen=True)
class Split:
    """Names of the motions that are trained and tested on."""

    train: tuple[str, ...]
    test: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All of them."""
        return self.train + self.test


@cache
def split() -> Split:
    """The split of the repository.

    Raises:
        InputError: a motion is in both parts, or in one twice.
    """
    read = tables.read(Split, SPLIT, "split")
    if twice := sorted({name for name in read.names if read.names.count(name) > 1}):
        raise InputError(f"{SPLIT}: found {', '.join(twice)} more than once; valid: each motion in one part")
    return read


@dataclass(frozen=True, eq=False)
class Clip:
    """A motion of the corpus: T frames, M points of the body.

    Attributes:
        name: of the motion.
        times_s: (T,) uniform.
        point_names: M names.
        truth, simulation, fit: (T, M, 3) in the world, the floor at z = 0.
        simulated: (T,) whether a frame was simulated.
    """

    name: str
    times_s: Array
    point_names: tuple[str, ...]
    truth: Array
    simulation: Array
    fit: Array
    simulated: Flags


def join(folder: Path) -> str:
    """Put truth and reconstruction of every finished clip side by side, and write `corpus.json`.

    Args:
        folder: of the corpus.

    Returns:
        How many clips there are, in words.
    """
    (folder / "clips").mkdir(exist_ok=True)
    rows = []
    for name in split().names:
        result = folder / "results" / name
        if (result / "motion.npz").is_file():
            clip = _joined(folder, name)
            atomic.write_npz(folder / "clips" / f"{name}.npz", _content(clip))
            rows.append(figures(clip))
    atomic.write_json(folder / "corpus.json", rows)
    return f"{counted(len(rows), 'clip')} of {len(split().names)} are in {folder / 'clips'}"


def read(path: Path) -> Clip:
    """A clip that `join` wrote."""
    with np.load(path, allow_pickle=False) as kept:
        values = {key: kept[key] for key in kept.files}
    names = tuple(str(name) for name in values.pop("point_names"))
    return Clip(path.stem, point_names=names, **values)


def truths(folder: Path, names: Sequence[str]) -> list[Clip]:
    """True motions alone, in the place of all three, as tests need no reconstruction."""
    found = []
    for name in names:
        with np.load(folder / "truth" / f"{name}.npz", allow_pickle=False) as truth:
            marks, times_s = truth["joints_m"], truth["times_s"]
            points = tuple(str(point) for point in truth["joint_names"])
        found.append(Clip(name, times_s, points, marks, marks, marks, np.ones(len(times_s), bool)))
    return found


def figures(clip: Clip) -> dict[str, Any]:
    """Mean distances of fit and simulation from the truth, mm: in the world, and relative to the pelvis."""
    pelvis = clip.point_names.index("pelvis")

    def apart(of: str) -> dict[str, float]:
        theirs, ours = clip.truth[clip.simulated], getattr(clip, of)[clip.simulated]
        relative = (ours - ours[:, [pelvis]]) - (theirs - theirs[:, [pelvis]])
        return {
            f"{of}_mpjpe_g_mm": 1e3 * float(np.linalg.norm(ours - theirs, axis=-1).mean()),
            f"{of}_mpjpe_mm": 1e3 * float(np.linalg.norm(relative, axis=-1).mean()),
        }

    return {
        "name": clip.name,
        "part": "test" if clip.name in split().test else "train",
        "seconds": float(clip.times_s[-1] - clip.times_s[0]),
        "frames": len(clip.times_s),
        "simulated": int(clip.simulated.sum()),
        **apart("fit"),
        **apart("simulation"),
    }


def _joined(folder: Path, name: str) -> Clip:
    result = results.open_result(folder / "results" / name)
    motion, body = result.motion, result.body
    if motion.kinematic_qpos is None:
        raise InputError(f"{result.folder}: found no kinematic fit; valid: a result that holds it")
    with np.load(folder / "truth" / f"{name}.npz", allow_pickle=False) as truth:
        names, marks = tuple(str(point) for point in truth["joint_names"]), truth["joints_m"]
    own = [body.skeleton.point_names.index(point) for point in names]
    simulation, fit = (
        kinematics.configurations(body, qpos)[1][:, own] for qpos in (motion.qpos, motion.kinematic_qpos)
    )
    return Clip(name, motion.times_s, names, marks, simulation, fit, motion.status == 0)


def _content(clip: Clip) -> dict[str, Any]:
    return {
        "times_s": clip.times_s,
        "point_names": np.array(clip.point_names),
        "truth": clip.truth,
        "simulation": clip.simulation,
        "fit": clip.fit,
        "simulated": clip.simulated,
    }
