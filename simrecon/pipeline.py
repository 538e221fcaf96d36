"""From evidence to a simulated motion; read this first.

    evidence ─► resample ─► kinematics.fit ─► planner ─► problem ─► tracker, by window ─► replay
    Evidence                 KinematicFit     Reference   Problem        WindowResult      Motion

Data goes one way. Between windows only a `Handover` passes: the exact state of the simulation, and the knots.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from simrecon import engines, kinematics, planners, replay, schedule
from simrecon.body import ShapeRequest
from simrecon.engines import checkpoint as checkpoints
from simrecon.engines import problem as problems
from simrecon.engines import warm_start, windows
from simrecon.engines.problem import Problem
from simrecon.evidence import resample
from simrecon.observer import SILENT, Observer
from simrecon.plan import Plan
from simrecon.replay import Audit
from simrecon.scene import check
from simrecon.sim.rollout import Threads
from simrecon.types import Evidence, KinematicFit, Motion, Reference, Scene, WindowResult


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """All that was computed for a clip, stage by stage.

    Attributes:
        evidence: as it was read; fit: the kinematic half; reference: what the planner made of it.
        problem: what the engine worked on; windows: solved, in order.
        motion: what was simulated; audit: of the final replay.
        seconds: wall time by stage; cpu_s: processor time of all stages.
    """

    evidence: Evidence
    fit: KinematicFit
    reference: Reference
    problem: Problem
    windows: tuple[WindowResult, ...]
    motion: Motion
    audit: Audit
    seconds: dict[str, float]
    cpu_s: float


def reconstruct(
    evidence: Evidence,
    scene: Scene,
    plan: Plan,
    *,
    planner: str = "none",
    engine: str = "sampling",
    seed: int = 0,
    threads: Threads = 0,
    shape: ShapeRequest | None = None,
    observer: Observer = SILENT,
    start: Motion | None = None,
    fit: KinematicFit | None = None,
    checkpoint: checkpoints.Store | None = None,
    identity: str = "",
) -> Reconstruction:
    """Reconstruct a motion that a simulator really executed.

    Args:
        evidence: what one camera saw.
        scene: what the person may touch.
        plan: how the clip is cut and optimised.
        planner: name of what turns the kinematic fit into the reference (`planners.names()`).
        engine: name of what optimises the simulation (`engines.names()`).
        seed: of all random numbers; the result depends on nothing else, not even on `threads`.
        threads: of the simulator, 0 for one per core; a function is asked again and again.
        shape: of the body, as far as it is known; None: the proportions of the average.
        observer: hears of the progress, and may end the run.
        start: a finished motion of the same clip, perhaps in another scene, to begin from.
        fit: the kinematic half on the uniform clock of the evidence, if it is known; None: it is fitted.
        checkpoint: where solved windows are kept, and taken from; None: nowhere.
        identity: of the job and the code, without which a checkpoint is of another run.

    Raises:
        InputError: the evidence, the scene, the shape or the motion to start from can't be used, or there is
            no such planner or engine.
    """
    planners.check(planner)
    engines.check(engine)
    marks, cpu_s = [time.perf_counter()], time.process_time()
    uniform, grid = resample(evidence)
    clock = schedule.clock(uniform.times_s, plan.simulation.timestep_max_s)
    observer.stage("kinematic fit", 0.0, clock.duration_s)
    if fit is None:
        fit = kinematics.fit(uniform, scene, plan.kinematics, shape)
    reference = planners.plan(planner, fit, uniform, plan)
    marks.append(time.perf_counter())

    problem = problems.pose(fit, reference, uniform, clock, plan)
    check.refuse_start(problem.model, fit.scene, problem.qpos[0])
    problem, handover = warm_start.begin(problem, start)
    pieces = schedule.cut(clock, plan)
    known: list[WindowResult] = []
    if checkpoint is not None:
        known = checkpoint.restore(checkpoints.digest(problem, handover, seed, identity), pieces)
    observer.resumed(known, pieces)
    tracker = engines.make(engine, problem, threads)
    if start is None and len(known) < len(pieces):
        tracker.prepare(pieces, handover)
    keep = None if checkpoint is None else checkpoint.save
    solved = windows.solve(tracker, pieces, handover, seed, known, observer, keep)
    marks.append(time.perf_counter())

    motion, audit = replay.record(problem, fit, solved, evidence.times_s, grid)
    marks.append(time.perf_counter())
    seconds = dict(zip(("kinematics", "simulation", "record"), np.diff(marks).tolist(), strict=True))
    seconds["simulation"] += sum(result.seconds for result in known)
    cpu_s = time.process_time() - cpu_s
    return Reconstruction(evidence, fit, reference, problem, solved, motion, audit, seconds, cpu_s)
