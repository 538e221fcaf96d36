"""Scores of a result folder beside its input, its kinematic fit and other methods, for `simrecon eval`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from simrecon import evidence
from simrecon.evaluation import fitted, simulated
from simrecon.evaluation import items as things
from simrecon.metrics import joints, plausibility, statistics
from simrecon.metrics.definitions import DEFINITIONS, GROUPS
from simrecon.metrics.joints import Clip, Scores
from simrecon.metrics.truth import BODY_JOINTS, Truth, canonical, covered_times, read_truth
from simrecon.replay import SIMULATED
from simrecon.types import Evidence, Scene

SCHEMA = "simrecon.scores/1"
OF_POSE = ("mpjpe_mm", "mpjpe_pa_mm", "pck_pct")
"""Scores that don't ask where the person is."""
RESULT, KINEMATIC, INPUT, REFERENCE = "result", "kinematic", "input", "reference"


@dataclass(frozen=True, eq=False)
class Table:
    """Scores by motion and name.

    Attributes:
        values: by motion (`result`, `kinematic`, `input`, peers by name, `reference`) and score.
        intervals: the same, of scores that are means over frames: lower and upper limit.
        bootstrap: how the intervals were made.
    """

    values: dict[str, dict[str, float]]
    intervals: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    bootstrap: dict[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """For JSON: one entry by motion, then `intervals` and `bootstrap`."""
        return {
            "schema": SCHEMA,
            **self.values,
            "intervals": {name: {k: list(v) for k, v in row.items()} for name, row in self.intervals.items()},
            "bootstrap": self.bootstrap,
        }


def score(
    folder: Path | str, truth: Path | str, given: Path | str | None = None, *, seed: int | None = 0
) -> Table:
    """Scores of a result, of what it was made from and follows, of other methods, and of the reference.

    Args:
        folder: of the result.
        truth: the reference, `simrecon.truth/1`.
        given: the evidence; its 3D joints are scored as they are in the world, and as poses otherwise.
        seed: of the bootstrap; None leaves the intervals out.

    Returns:
        The table; a score that can't be computed is missing.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    of, reference = simulated.read(folder), read_truth(truth)
    kept, names = of.motion.status == SIMULATED, of.motion.joint_names
    motion = joints.track(of.motion.times_s, names, of.motion.joints_m, "motion", of.rest_m)
    target, on = _compared(motion, reference, of.scene, of.radii_m)
    found: dict[str, Scores] = {RESULT: _both(motion, on)}
    found[RESULT] |= simulated.geometry(of.body, names, motion.times_s, kept)
    found[RESULT] |= simulated.forces(of, on) | simulated.reported(of)
    found[RESULT] |= things.scores(of, on)
    if reference.plates is not None:
        mass = reference.mass_kg or of.mass_kg
        found[RESULT] |= simulated.against_plates(of, reference.plates, target.times_s, on, mass)
    if of.kinematic is not None:
        fit = replace(motion, joints_m=of.kinematic.points_m)
        shape = simulated.geometry(of.kinematic, names, motion.times_s, kept)
        found[KINEMATIC] = _both(fit, on) | shape
    return _table(RESULT, found | _others(reference, target, given, on), on, seed)


def score_fit(
    path: Path, truth: Path | str, given: Path | str | None = None, *, seed: int | None = 0
) -> Table:
    """Scores of a kinematic fit, its input, other methods and the reference.

    Args:
        path: of the fit, `simrecon.fit/1`.
        truth: the reference, `simrecon.truth/1`.
        given: the evidence.
        seed: of the bootstrap; None leaves the intervals out.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    of, reference = fitted.read(path), read_truth(truth)
    motion = joints.track(of.times_s, of.names, of.shape.points_m, "kinematic fit", of.rest_m)
    target, on = _compared(motion, reference, of.scene)
    image = Scores({}, {"mpjpe_2d_px": of.mpjpe_2d_px})
    found = {KINEMATIC: _both(motion, on) | simulated.geometry(of.shape, of.names, of.times_s) | image}
    return _table(KINEMATIC, found | _others(reference, target, given, on), on, seed)


def _compared(
    motion: joints.Track, reference: Truth, scene: Scene, radii_m: Mapping[str, float] | None = None
) -> tuple[joints.Track, Clip]:
    """The reference of a motion, and what both are compared on; radii of the person's capsules, if known."""
    target = joints.track(reference.times_s, reference.joint_names, reference.joints_m, "reference")
    times = covered_times(motion.times_s, target.times_s)
    feet = [name for name in motion.names if name in target.names]
    return target, joints.clip(target, times, scene, feet, radii_m)


def _others(reference: Truth, target: joints.Track, given: Path | str | None, on: Clip) -> dict[str, Scores]:
    """Scores of the input, of other methods, and of the reference."""
    found: dict[str, Scores] = {}
    if given is not None:
        seen = evidence.read(given)
        if seen.joint_names:
            found[INPUT] = _of_input(seen, on)
    for name, peer in reference.peers.items():
        found[name] = _both(joints.Track(target.times_s, target.names, peer), on)
    found[REFERENCE] = plausibility.plausibility(target, on)
    return found


def _of_input(seen: Evidence, on: Clip) -> Scores:
    """Scores of a 3D estimate: all in the world; those of the pose alone in the camera's frame."""
    places = seen.joints_m
    if not set(BODY_JOINTS) <= set(canonical(seen.joint_names)):
        return Scores()
    if seen.joints_frame == "world":
        return _both(joints.track(seen.times_s, seen.joint_names, places, "evidence"), on)
    if seen.camera is None or seen.camera.path is None:
        return Scores()
    turned = places @ seen.camera.path[:, :3, :3]  # Rᵀ x, row vectors
    scores = joints.accuracy(joints.track(seen.times_s, seen.joint_names, turned, "evidence"), on)
    return Scores({name: series for name, series in scores.series.items() if name in OF_POSE})


def _table(first: str, found: dict[str, Scores], on: Clip, seed: int | None) -> Table:
    """Values and, with a seed, their intervals; `first` says what share of the reference is covered."""
    values = {name: scores.values for name, scores in found.items()}
    values[first] = {"covered": len(on.times_s) / len(on.truth.times_s)} | values[first]
    if seed is None:
        return Table(values)
    limits = {
        name: statistics.intervals(scores.series, float(np.ptp(on.times_s)), seed=seed)
        for name, scores in found.items()
    }
    known = {
        name: {key: pair for key, pair in row.items() if np.isfinite(pair).all()}
        for name, row in limits.items()
    }
    how = {"seed": seed, "samples": statistics.SAMPLES, "block_s": statistics.BLOCK_S}
    return Table(values, known, how | {"level": statistics.LEVEL})


def _both(motion: joints.Track, on: Clip) -> Scores:
    return joints.accuracy(motion, on) | plausibility.plausibility(motion, on)


def text(table: Table) -> str:
    """Scores as aligned text: a line for each score, a column for each motion, and the definition."""
    columns = list(table.values)
    lines = [["", *columns, "[result]" if table.bootstrap else "", ""]]
    for group, names in GROUPS.items():
        shown = [name for name in names if any(name in table.values[column] for column in columns)]
        if shown:
            lines += [[""] * (len(columns) + 3), [group, *[""] * (len(columns) + 2)]]
            lines += [_line(name, table, columns) for name in shown]
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    widths[0] = max(map(len, DEFINITIONS))
    body = [
        "  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:-1], widths[1:-1]), line[-1]]).rstrip()
        for line in lines
    ]
    if not table.bootstrap:
        return "\n".join(body)
    how = table.bootstrap
    note = (
        f"[ ] {100 * how['level']:.0f} % interval of the result: {how['samples']:.0f} resamples of frames "
        f"in blocks of {how['block_s']:g} s, seed {how['seed']:.0f}"
    )
    return "\n".join([*body, "", note])


def _line(name: str, table: Table, columns: list[str]) -> list[str]:
    found = [number(table.values[column].get(name)) for column in columns]
    pair = table.intervals.get(RESULT, {}).get(name)
    limits = "" if pair is None else f"[{number(pair[0])}, {number(pair[1])}]"
    return [name, *found, limits, DEFINITIONS[name]]


def number(value: float | None) -> str:
    """A number of three digits, or all of its whole ones; `-` for none."""
    if value is None:
        return "-"
    if value == 0 or abs(value) < 1e-9:
        return "0"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def plain(values: Mapping[str, float]) -> dict[str, float]:
    """Values that JSON can hold."""
    return {name: float(value) for name, value in values.items() if np.isfinite(value)}
