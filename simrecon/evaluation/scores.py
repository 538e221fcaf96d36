"""Scores of a result folder beside its input, its kinematic fit and other methods, for `simrecon eval`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from simrecon import evidence
from simrecon.evaluation import fitted, items, simulated, table
from simrecon.evaluation.accuracy import accuracy
from simrecon.evaluation.comparison import Comparison, Track, comparison, track
from simrecon.evaluation.forces import forces
from simrecon.evaluation.geometry import geometry
from simrecon.evaluation.plates import against_plates, against_pushes
from simrecon.evaluation.plausibility import plausibility
from simrecon.evaluation.table import INPUT, KINEMATIC, PLAN, REFERENCE, RESULT, Table
from simrecon.evidence.cutting import WHOLE, Span
from simrecon.metrics.rates import covered_times
from simrecon.metrics.statistics import Scores
from simrecon.metrics.truth import BODY_JOINTS, Truth, canonical, read_truth
from simrecon.types import Evidence, Scene

OF_POSE = ("mpjpe_mm", "mpjpe_pa_mm", "pck_pct")
"""Scores that don't ask where the person is."""


def score(
    folder: Path | str,
    truth: Path | str,
    seen: Evidence | Path | str | None = None,
    *,
    seed: int | None = 0,
    span: Span = WHOLE,
) -> Table:
    """Scores of a result, of what it was made from and follows, of other methods, and of the reference.

    Args:
        folder: of the result.
        truth: the reference, `simrecon.truth/1`.
        seen: the evidence, or its file; its 3D joints are scored as they are in the world, and as poses
            otherwise.
        seed: of the bootstrap; None leaves the intervals out.
        span: times of the result that are scored.

    Returns:
        The table; a score that can't be computed is missing.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    result, reference = simulated.read(folder, span), read_truth(truth)
    motion = result.motion
    own = track(motion.times_s, motion.joint_names, motion.joints_m, "motion", result.rest_m)
    target, on = _compared(own, reference, result.scene, result.radii_m)
    rows = {RESULT: _of_result(result, own, on) | _measured(result, reference, on)}
    kept = motion.kept
    for name, shape in ((KINEMATIC, result.kinematic), (PLAN, result.planned)):
        if shape is not None:
            before = replace(own, joints_m=shape.points_m)
            of_primitives = geometry(shape, motion.joint_names, motion.times_s, kept)
            rows[name] = _of_joints(before, on) | of_primitives
    return table.make(RESULT, rows | _others(reference, target, seen, on), on, seed)


def score_fit(
    path: Path, truth: Path | str, seen: Path | str | None = None, *, seed: int | None = 0
) -> Table:
    """Scores of a kinematic fit, its input, other methods and the reference.

    Args:
        path: of the fit, `simrecon.fit/1`.
        truth: the reference, `simrecon.truth/1`.
        seen: the evidence.
        seed: of the bootstrap; None leaves the intervals out.

    Raises:
        InputError: one line with the file, what was found and what is valid.
    """
    fit, reference = fitted.read(path), read_truth(truth)
    own = track(fit.times_s, fit.names, fit.shape.points_m, "kinematic fit", fit.rest_m)
    target, on = _compared(own, reference, fit.scene)
    image = Scores({}, {"mpjpe_2d_px": fit.mpjpe_2d_px})
    rows = {KINEMATIC: _of_joints(own, on) | geometry(fit.shape, fit.names, fit.times_s) | image}
    return table.make(KINEMATIC, rows | _others(reference, target, seen, on), on, seed)


def _compared(
    motion: Track, reference: Truth, scene: Scene, radii_m: Mapping[str, float] | None = None
) -> tuple[Track, Comparison]:
    """The reference of a motion, and what both are compared on; radii of the person's capsules, if known."""
    target = track(reference.times_s, reference.joint_names, reference.joints_m, "reference")
    times = covered_times(motion.times_s, target.times_s)
    feet = [name for name in motion.names if name in target.names]
    return target, comparison(target, times, scene, feet, radii_m, reference.pushes)


def _of_joints(motion: Track, on: Comparison) -> Scores:
    """All that joints allow."""
    return accuracy(motion, on) | plausibility(motion, on)


def _of_result(result: simulated.Simulated, motion: Track, on: Comparison) -> Scores:
    """All but force plates: of the joints, the primitives, the forces and the items of the scene."""
    kept = result.motion.kept
    shape = geometry(result.body, result.motion.joint_names, motion.times_s, kept)
    forced = forces(result, on) | simulated.reported(result) | items.scores(result, on)
    return _of_joints(motion, on) | shape | forced


def _measured(result: simulated.Simulated, reference: Truth, on: Comparison) -> Scores:
    """Forces against those of the reference, if it has any."""
    if not result.motion.knows_forces:
        return Scores()
    mass_kg = reference.mass_kg or result.mass_kg
    times_s = reference.times_s
    if reference.pushes is not None:
        return against_pushes(result.motion, reference.pushes, times_s, on, mass_kg)
    if reference.plates is not None:
        return against_plates(result.motion, reference.plates, times_s, on, mass_kg)
    return Scores()


def _others(
    reference: Truth, target: Track, seen: Evidence | Path | str | None, on: Comparison
) -> dict[str, Scores]:
    """Scores of the input, of other methods, and of the reference."""
    rows: dict[str, Scores] = {}
    if seen is not None:
        estimate = seen if isinstance(seen, Evidence) else evidence.read(seen)
        if estimate.joint_names:
            rows[INPUT] = _of_input(estimate, on)
    for name, peer in reference.peers.items():
        rows[name] = _of_joints(Track(target.times_s, target.names, peer), on)
    rows[REFERENCE] = plausibility(target, on)
    return rows


def _of_input(estimate: Evidence, on: Comparison) -> Scores:
    """Scores of a 3D estimate: all in the world; those of the pose alone in the camera's frame."""
    joints, camera = estimate.joints_m, estimate.camera
    if not set(BODY_JOINTS) <= set(canonical(estimate.joint_names)):
        return Scores()
    if estimate.joints_frame == "world":
        return _of_joints(track(estimate.times_s, estimate.joint_names, joints, "evidence"), on)
    if camera is None or camera.path is None:
        return Scores()
    turned = joints @ camera.path[:, :3, :3]  # Rᵀ x, row vectors
    scores = accuracy(track(estimate.times_s, estimate.joint_names, turned, "evidence"), on)
    return Scores({name: series for name, series in scores.series.items() if name in OF_POSE})
