"""Draft and commit: windows on their own first, all at a time, so that the pass that counts begins well.

Every window of a draft starts at the kinematic pose and velocity of its first frame, so the windows don't
wait for each other (as Gärtner 2022 did for long sequences). What is simulated in a draft is thrown away;
only its knots stay, as the warm start of the sequential pass, whose motion is one uninterrupted simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.task import Task, simulator
from simrecon.sim.poses import differentiate
from simrecon.sim.quiet import unlogged
from simrecon.sim.rollout import Threads
from simrecon.sim.state import initial_state
from simrecon.system import blas, processor
from simrecon.types import Array, Handover, Window


@blas.one_thread()
def drafted(problem: Problem, windows: Sequence[Window], start: Handover, threads: Threads = 0) -> Problem:
    """The problem with knots from `draft_steps` Gauss-Newton steps on every window by itself.

    The result does not depend on the number of threads.

    Args:
        problem: the clip.
        windows: of the clip.
        start: where the first window begins.
        threads: windows at a time, each stepped by one thread; 0 = one per core.
    """
    steps = problem.plan.optimiser.draft_steps
    if not steps:
        return problem
    count = threads() if callable(threads) else threads
    with unlogged(), ThreadPoolExecutor(count or processor.cores()) as pool:
        handovers = list(pool.map(lambda window: _knots(problem, window, start, steps), windows))
    draft = problem.draft_rad.copy()
    for own in handovers:  # the next window takes over where it begins
        draft[own.first : own.first + len(own.knots_rad)] = own.knots_rad
    return replace(problem, draft_rad=draft)


def _knots(problem: Problem, window: Window, start: Handover, steps: int) -> Handover:
    """What a window by itself would hand over."""
    if window.index:
        start = replace(start, state=_kinematic_state(problem, window))
    task = Task(problem, window, start)
    descent = Descent.begin(task, simulator(problem, 1), task.warm_start()[None])
    for _ in range(steps):
        descent.step()
    return Handover(start.state, descent.task.knots_of(descent.x), descent.task.knots.start)


def _kinematic_state(problem: Problem, window: Window) -> Array:
    """Full state (nstate,) of the kinematic pose and velocity at the first frame of a window."""
    frame = window.start_step // problem.clock.stride
    around = problem.qpos[frame - 1 : frame + 2]
    qvel = differentiate(problem.model, around, problem.clock.frame_s)[1]
    return initial_state(problem.model, problem.qpos[frame], qvel)
