"""Which futures of the network that ships a simulation follows to the end."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from simrecon import futures, kinematics, results
from simrecon.errors import InputError
from simrecon.io import atomic
from simrecon.results import Result
from simrecon.synthesis.features import CONTEXT, RATE_HZ
from simrecon.types import Array
from tools.train.synthesis_data import Test

EACH = 2
"""Futures of one moment."""
BALANCE_M, NEAR_M = 0.1, 0.05
"""In balance: the centre of mass, as fast as it is, will come to rest over the feet that touch, or so near to
them (Hof 2005, its extrapolated place). Feet this near to the floor touch it."""
GRAVITY_MPS2 = 9.81


def followed(corpus: Path, tests: list[Test], options: argparse.Namespace) -> list[dict[str, Any]]:
    """Run futures of motions of the corpus that are simulated, spread over the tests; those done are kept."""
    rows: list[dict[str, Any]] = []
    names = sorted({test.name for test in tests})
    for number in range(-(-options.simulate // EACH)):
        name, turn = names[number % len(names)], number // len(names)
        source, folder = corpus / "results" / name, options.work / "simulated" / f"{name}_{turn}"
        if not (source / "motion.npz").is_file():
            continue
        record = folder / "followed.json"
        if not record.is_file():
            became = _run(source, folder, turn, options.threads)
            folder.mkdir(parents=True, exist_ok=True)  # there is none where all were refused
            atomic.write_json(record, became)
        rows += json.loads(record.read_text(encoding="utf-8"))
    return rows


def _run(source: Path, folder: Path, turn: int, threads: int) -> list[dict[str, Any]]:
    """What became of the futures of a moment."""
    times_s = results.open_result(source).motion.times_s
    at_s = float(times_s[0]) + (CONTEXT - 1) / RATE_HZ + 0.8 * turn
    if at_s > times_s[-1]:
        return []
    try:
        made = futures.synthesize(
            source, folder, at_s=at_s, samples=EACH, simulate=True, threads=threads, no_report=True
        )
    except InputError as error:
        return [{"name": source.name, "at_s": at_s, "refused": str(error)}]
    return [_row(source.name, at_s, result) for result in made.results]


def _row(name: str, at_s: float, result: Result) -> dict[str, Any]:
    motion, report = result.motion, result.report
    fell = bool(report["agreement"]["fell"])
    return {
        "name": name,
        "at_s": at_s,
        "to_the_end": not fell and not report["frames"]["fallback"],
        "balanced": margin_m(result) <= BALANCE_M,
        "apart_mm": 1e3 * float(report["agreement"]["fit_mean_m"]),
        "frames": len(motion.times_s),
    }


def margin_m(result: Result) -> float:
    """How far the extrapolated centre of mass is outside the feet that touch in the first frame, m."""
    motion, body = result.motion, result.body
    qpos = motion.kinematic_qpos if motion.kinematic_qpos is not None else motion.qpos
    com_m, marks = kinematics.configurations(body, qpos[:2])
    points = body.skeleton.point_names
    ends = [points.index(f"{side}_{end}") for side in ("left", "right") for end in ("heel", "toe")]
    low = marks[0, ends]
    low = low[low[:, 2] < NEAR_M, :2]
    if not len(low):
        return float("inf")
    speed = (com_m[1] - com_m[0]) / (motion.times_s[1] - motion.times_s[0])
    rate = np.sqrt(GRAVITY_MPS2 / max(com_m[0, 2], 0.2))
    return outside_m(com_m[0, :2] + speed[:2] / rate, low)


def outside_m(place: Array, points: Array) -> float:
    """Distance (m) of a place (2,) from the convex hull of points (P, 2); 0 inside."""
    weight = 1e3  # of the shares' sum
    left = np.vstack((points.T, np.full(len(points), weight)))
    shares, _ = nnls(left, np.append(place, weight))
    return float(np.linalg.norm(points.T @ shares - place))
