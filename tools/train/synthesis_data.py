"""Windows of motions for the training of the synthesis: half a second that is known, and what follows.

Of truth, simulation and fit the same frames are taken, so that nothing but the motions differs: those that
were simulated, and in which the simulation stayed within `NEAR_M` of what it followed, which is known without
the truth. Each window is there in its mirror image too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simrecon.errors import InputError
from simrecon.synthesis.features import CONTEXT, COUNT, FUTURE, POINTS, RATE_HZ, features, stand
from simrecon.types import Array, arrays
from tools.train import synthesis_corpus
from tools.train.synthesis_corpus import Clip

NEAR_M = 0.2
SHORTEST = 15
"""Frames of a future that ends early, for short motions; what is not there has no share in the loss."""
TEST_STEP = 5
"""Frames from one test to the next of a motion."""


@dataclass(frozen=True, eq=False)
class Windows:
    """N windows of features; where a motion ends early, its last frame is repeated.

    Attributes:
        context: (N, CONTEXT, COUNT); future: (N, FUTURE, COUNT).
        there: (N, FUTURE) 1 where the motion goes on, else 0.
    """

    context: Array
    future: Array
    there: Array


@dataclass(frozen=True, eq=False)
class Test:
    """A window of a true motion, in the world.

    Attributes:
        name: of the motion.
        height_m: stature of the person.
        joints_m: (CONTEXT + FUTURE, K, 3) `features.POINTS`.
    """

    name: str
    height_m: float
    joints_m: Array


def clips(folder: Path, names: Sequence[str]) -> list[Clip]:
    """Those of the corpus that are finished.

    Raises:
        InputError: there is none.
    """
    paths = [folder / "clips" / f"{name}.npz" for name in names]
    found = [synthesis_corpus.read(path) for path in paths if path.is_file()]
    if not found:
        raise InputError(f"{folder}: holds no clips; valid: a folder of tools.train.reconstruct_corpus")
    return found


def windows(found: Sequence[Clip], kind: str, heights_m: dict[str, float], step: int = 1) -> Windows:
    """All windows of motions.

    Args:
        found: the motions.
        kind: one of `synthesis_corpus.KINDS`.
        heights_m: stature by name.
        step: frames from one window to the next.
    """
    rows = [
        _window(joints[start:], heights_m[clip.name])
        for clip in found
        for run in runs(clip)
        for joints in _both(getattr(clip, kind)[run][:, rows_of(clip)])
        for start in range(0, len(joints) - CONTEXT - SHORTEST + 1, step)
    ]
    context, future, there = (np.stack(columns) for columns in zip(*rows, strict=True))
    return Windows(context, future, there)


def runs(clip: Clip) -> Iterator[slice]:
    """Stretches of a clip that can be used, long enough for a window."""
    away = np.linalg.norm(clip.simulation - clip.fit, axis=-1).mean(axis=1)  # (T,)
    for rows in arrays.runs(clip.simulated & (away < NEAR_M)):
        if rows.stop - rows.start >= CONTEXT + SHORTEST:
            yield rows


def rows_of(clip: Clip) -> list[int]:
    """Where the predicted points are among those of a clip.

    Raises:
        InputError: the clip has another rate.
    """
    rate_hz = 1.0 / float(np.median(np.diff(clip.times_s)))
    if abs(rate_hz - RATE_HZ) > 1.0:
        raise InputError(f"{clip.name}: found {rate_hz:.1f} frames a second; valid: {RATE_HZ:g}")
    return [clip.point_names.index(name) for name in POINTS]


def mirrored(joints_m: Array) -> Array:
    """The mirror image of joints (..., K, 3) of `POINTS`."""
    swap = {"left": "right", "right": "left"}
    parts = [name.split("_", 1) for name in POINTS]
    other = [POINTS.index("_".join([swap.get(part[0], part[0]), *part[1:]])) for part in parts]
    return np.asarray(joints_m[..., other, :] * [1.0, -1.0, 1.0])


def tests(found: Sequence[Clip], heights_m: dict[str, float]) -> list[Test]:
    """Windows of the true motions, every `TEST_STEP` frames of those that are long enough."""
    length = CONTEXT + FUTURE
    return [
        Test(clip.name, heights_m[clip.name], clip.truth[start : start + length][:, rows_of(clip)])
        for clip in found
        for start in range(0, len(clip.times_s) - length + 1, TEST_STEP)
    ]


def heights(folder: Path) -> dict[str, float]:
    """Statures of the persons of a corpus by the name of the motion, m."""
    found = {}
    for path in (folder / "truth").glob("*.npz"):
        with np.load(path, allow_pickle=False) as truth:
            found[path.stem] = float(truth["height_m"])
    return found


def _both(joints_m: Array) -> tuple[Array, Array]:
    return joints_m, mirrored(joints_m)


def _window(joints_m: Array, height_m: float) -> tuple[Array, Array, Array]:
    """Context, future and what of it is there, of a motion from here on (T, K, 3)."""
    part = joints_m[: CONTEXT + FUTURE]
    values = features(part, stand(part[CONTEXT - 1], height_m))
    future = np.zeros((FUTURE, COUNT))
    length = len(part) - CONTEXT
    future[:length] = values[CONTEXT:]
    future[length:] = values[-1]
    return values[:CONTEXT], future, (np.arange(FUTURE) < length).astype(float)
