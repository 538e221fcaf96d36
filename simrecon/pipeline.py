"""From evidence to a simulated motion; read this first.

    evidence ─► resample ─► kinematics.fit ─► planner ─► problem ─► tracker, by window ─► replay
    Evidence                 KinematicFit     Reference   Problem        WindowResult      Motion

Data goes one way. Between windows only a `Handover` passes: the exact state of the simulation, and the knots.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial

import numpy as np

from simrecon import engines, kinematics, planners, replay, schedule
from simrecon.body import ShapeRequest
from simrecon.engines import checkpoint as checkpoints
from simrecon.engines import problem as problems
from simrecon.engines import restarts, warm_start, windows
from simrecon.engines.problem import Problem
from simrecon.evidence import resample
from simrecon.observer import SILENT, Observer
from simrecon.plan import Plan
from simrecon.replay import Audit
from simrecon.scene import check
from simrecon.sim.rollout import Threads
from simrecon.types import ContactWish, Evidence, KinematicFit, Motion, Reference, Scene, WindowResult


@dataclass(frozen=True, eq=False)
class Setup:
    """How a clip is reconstructed, beyond its plan.

    Attributes:
        planner, engine: names of what makes the reference and of what optimises the simulation.
        seed: of all random numbers; the result depends on nothing else, not even on `threads`.
        threads: of the simulator, 0 for one per core; a function is called before each generation.
        shape: of the body, as far as it is known, or None; contacts: what a user wishes of them.
        start: a finished motion of the clip, perhaps in another scene, to begin from; fit: if it is known.
        observer: is told of the progress, and may stop the run.
        checkpoint: where windows solved under the same `identity`, of job and code, are kept; None: nowhere.
    """

    planner: str = "none"
    engine: str = "sampling"
    seed: int = 0
    threads: Threads = 0
    shape: ShapeRequest | None = None
    contacts: tuple[ContactWish, ...] = ()
    start: Motion | None = None
    fit: KinematicFit | None = None
    observer: Observer = SILENT
    checkpoint: checkpoints.Store | None = None
    identity: str = ""


DEFAULT = Setup()


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """All that was computed for a clip, stage by stage.

    Attributes:
        evidence, fit, reference, problem, windows: what each stage worked on, or made; windows in order.
        motion: simulated, or planned; audit: of it; seconds: by stage; cpu_s: processor time of all.
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


def reconstruct(evidence: Evidence, scene: Scene, plan: Plan, setup: Setup = DEFAULT) -> Reconstruction:
    """Reconstruct a motion that a simulator really executed.

    Args:
        evidence: what one camera saw.
        scene: what the person may touch.
        plan: how the clip is cut and optimised.
        setup: everything else.

    Raises:
        InputError: one of them can't be used, or there is no such planner or engine.
    """
    planners.check(setup.planner)
    engines.check(setup.engine)
    marks, cpu_s = [time.perf_counter()], time.process_time()
    uniform, grid = resample(evidence)
    clock = schedule.clock(uniform.times_s, plan.simulation.timestep_max_s)
    warm_start.check_beginning(setup.start, clock.frame_s, uniform.times_s)
    setup.observer.stage("kinematic fit", 0.0, clock.duration_s)
    fit = setup.fit or kinematics.fit(uniform, scene, plan.kinematics, setup.shape, setup.contacts)
    reference = planners.plan(setup.planner, fit, uniform, plan)
    fit = planners.embodied(fit, reference)
    marks.append(time.perf_counter())
    problem = problems.pose(fit, reference, uniform, clock, plan)
    simulates = engines.simulates(setup.engine)
    solved, earlier_s = _simulate(problem, fit, setup) if simulates else ((), 0.0)
    marks.append(time.perf_counter())
    show = partial(replay.record, windows=solved) if simulates else partial(replay.plan, reference=reference)
    motion, audit = show(problem, fit, times_s=evidence.times_s, grid=grid)
    motion = replay.banded(motion, problem, fit, reference, solved, grid)
    marks.append(time.perf_counter())
    seconds = dict(zip(("kinematics", "simulation", "record"), np.diff(marks).tolist(), strict=True))
    seconds["simulation"] += earlier_s
    cpu_s = time.process_time() - cpu_s
    return Reconstruction(evidence, fit, reference, problem, solved, motion, audit, seconds, cpu_s)


def _simulate(problem: Problem, fit: KinematicFit, setup: Setup) -> tuple[tuple[WindowResult, ...], float]:
    """All windows, solved where no checkpoint holds them, and the seconds spent on those it held."""
    check.refuse_start(problem.model, fit.scene, problem.qpos[0])
    problem, handover = warm_start.begin(problem, setup.start)
    pieces = schedule.cut(problem.clock, problem.plan)
    store, digest = setup.checkpoint, checkpoints.digest(problem, handover, setup.seed, setup.identity)
    keep, known = (store.save, store.restore(digest, pieces)) if store else (None, [])
    setup.observer.resumed(known, pieces)
    tracker = engines.make(setup.engine, problem, setup.threads)
    if setup.start is None and len(known) < len(pieces):
        tracker.prepare(pieces, handover)
    anew = partial(restarts.begin, problem, fit)
    solved = windows.solve(tracker, pieces, handover, setup.seed, known, setup.observer, keep, anew)
    return solved, sum(result.seconds for result in known)
