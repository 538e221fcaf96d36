"""A kinematic fit in a file of its own (`simrecon.fit/1`), and its scores; no simulation is needed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simrecon import scene as scenes
from simrecon.evaluation.configurations import Configurations, configurations, foot_rest
from simrecon.io import atomic
from simrecon.io.npz import load
from simrecon.metrics import statistics
from simrecon.sim.address import with_items_at_rest
from simrecon.sim.models import compile_foreign
from simrecon.types import Array, KinematicFit, Scene

SCHEMA = "simrecon.fit/1"
TIMESTEP_S = 0.01
"""Of the model, with which nothing is simulated."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit that was read; T frames.

    Attributes:
        times_s: (T,); names: K points of the body; scene: that the person was fitted in.
        shape: of its configurations; rest_m: height of heels and toes over the sole (`comparison.Track`).
        mpjpe_2d_px: mean distance of the points from the detections in the image, NaN without any.
        seconds_per_second: processor time over the length of the clip.
    """

    times_s: Array
    names: tuple[str, ...]
    scene: Scene
    shape: Configurations
    rest_m: dict[str, float]
    mpjpe_2d_px: float
    seconds_per_second: float


def write(path: Path, fit: KinematicFit, seconds: float) -> None:
    """Write a fit; the file is replaced at once.

    Args:
        path: the `.npz`, in an existing folder.
        fit: what to write.
        seconds: of processor time that it took.
    """
    arrays = {
        "schema": SCHEMA,
        "times_s": fit.times_s,
        "qpos": fit.qpos,
        "point_names": fit.body.skeleton.point_names,
        "parts": [part.name for part in fit.body.primitives],
        "mjcf": scenes.build(fit.body.mjcf, fit.scene, TIMESTEP_S),
        "scene": scenes.dumps(fit.scene),
        "reprojection_px": fit.reprojection_px,
        "seconds": seconds,
    }
    atomic.write_npz(path, arrays)


def read(path: Path) -> Fitted:
    """Read a fit and work out its geometry.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    arrays = load(path)
    arrays.text("schema", (SCHEMA,))
    times, qpos = arrays.finite("times_s", ("T",)), arrays.finite("qpos", ("T", "nq"))
    if len(times) < 2 or (np.diff(times) <= 0).any():
        arrays.fail("times_s", "times that do not increase", "two or more increasing times in seconds")
    names, parts = arrays.names("point_names", "K"), arrays.names("parts", "C")
    scene = scenes.parse(str(arrays.array("scene")), path)
    model = compile_foreign(str(arrays.array("mjcf")), f"{path}: mjcf")
    shape = configurations(model, scene, with_items_at_rest(model, qpos), parts, names)
    pixels = arrays.array("reprojection_px")
    if pixels.size:  # of a posed body it is empty
        pixels = arrays.floats("reprojection_px", ("T", "J"))
    span = float(times[-1] - times[0])
    return Fitted(
        times_s=times,
        names=names,
        scene=scene,
        shape=shape,
        rest_m=foot_rest(model),
        mpjpe_2d_px=float(statistics.of_frames(pixels).value),
        seconds_per_second=float(arrays.finite("seconds", ())) / span,
    )
