"""The main job, from evidence to simulated motion; read this first.

    evidence ─► resample ─► kinematics.fit ─► scene.build ─► schedule.cut ─► engine, by window ─► record

Data goes one way. Between windows only a `Handover` passes: the exact state of the simulation, and the knots.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simrecon import engines, kinematics, replay, schedule
from simrecon.body import Wanted
from simrecon.engines import checkpoint as checkpoints
from simrecon.engines import problem as problems
from simrecon.engines import warm_start as starts
from simrecon.engines import windows as clip
from simrecon.engines.problem import Problem
from simrecon.evidence import resample
from simrecon.plan import Plan
from simrecon.replay import Audit
from simrecon.scene import check
from simrecon.sim.rollout import Threads
from simrecon.types import Evidence, KinematicFit, Motion, Scene, WindowResult

Report = Callable[[str, float, float], None]
"""Called with the stage, how much of it is done and how much there is, in seconds of video."""


def _silent(_stage: str, _done: float, _total: float) -> None:
    """The report of a run that nobody watches."""


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """All that a run made.

    Attributes:
        evidence: as it was given; fit: the kinematic half; problem: what the engine worked on.
        windows: solved, in order; motion: what was simulated; audit: of the final replay.
        seconds: wall time by stage.
    """

    evidence: Evidence
    fit: KinematicFit
    problem: Problem
    windows: tuple[WindowResult, ...]
    motion: Motion
    audit: Audit
    seconds: dict[str, float]


def reconstruct(
    evidence: Evidence,
    scene: Scene,
    plan: Plan,
    *,
    seed: int = 0,
    threads: Threads = 0,
    wanted: Wanted | None = None,
    report: Report = _silent,
    start: Motion | None = None,
    checkpoint: checkpoints.Store | None = None,
    fit: KinematicFit | None = None,
) -> Reconstruction:
    """Reconstruct a motion that a simulator really executed.

    Args:
        evidence: what one camera saw.
        scene: what the person may touch.
        plan: how the clip is cut and optimised.
        seed: of all random numbers; the result does not depend on anything else, not even on `threads`.
        threads: of the simulator, 0 for one per core; a function is asked again and again.
        wanted: the body's shape, as far as it is known; None: the proportions of the average.
        report: told of the progress.
        start: a finished motion of the same clip, perhaps in another scene, to begin from.
        checkpoint: where solved windows are kept, and taken from; None: nowhere.
        fit: the kinematic half on the uniform clock of the evidence, if it is known; None: it is fitted.

    Raises:
        InputError: the evidence, the scene, the wanted shape or the motion to start from can't be used.
    """
    marks = [time.perf_counter()]
    uniform, grid = resample(evidence)
    clock = schedule.clock(uniform.times_s, plan.simulation.timestep_max_s)
    duration_s = clock.steps * clock.step_s
    report("kinematic fit", 0.0, duration_s)
    if fit is None:
        fit = kinematics.fit(uniform, scene, plan.kinematics, wanted)
    marks.append(time.perf_counter())

    problem = problems.pose(fit, uniform, problems.mjcf(fit, clock, plan), clock, plan)
    check.refuse_start(problem.model, fit.scene, problem.qpos[0])
    handover = starts.from_fit(problem)
    if start is not None:
        problem, handover = starts.from_motion(problem, start)
    windows = schedule.cut(clock, plan)
    known: list[WindowResult] = []
    if checkpoint is not None:
        known = checkpoint.restore(checkpoints.digest(problem, handover, seed), windows)
    tracker = engines.make("sampling", problem, threads)
    if start is None and len(known) < len(windows):
        tracker.prepare(windows, handover)
    earlier_s = sum(result.seconds for result in known)
    solved = clip.solve(
        tracker,
        windows,
        handover,
        seed,
        solved=known,
        begin=lambda window: report("simulation", window.start_step * clock.step_s, duration_s),
        keep=lambda result: None if checkpoint is None else checkpoint.save(result),
    )
    report("simulation", duration_s, duration_s)
    marks.append(time.perf_counter())

    motion, audit = replay.record(tracker.problem, fit, solved, evidence.times_s, grid)
    marks.append(time.perf_counter())
    seconds = dict(zip(("kinematics", "simulation", "record"), np.diff(marks).tolist(), strict=True))
    seconds["simulation"] += earlier_s
    return Reconstruction(evidence, fit, tracker.problem, solved, motion, audit, seconds)
