"""The tracker that samples: descent and CMA-ES on each window, perhaps after a draft of all.

Per window: minimise the loss of a rollout over the knots of cubic B-splines that are added to the kinematic
control targets. All that is tried is simulated, so contacts, torque limits and falls are the simulator's own.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.draft import drafted
from simrecon.engines.sampling.search import PATIENCE, Search
from simrecon.engines.sampling.task import Task
from simrecon.sim.rollout import Simulator, Threads
from simrecon.types import Effort, Handover, Window, WindowResult, WindowStatus

# The first window has no warm start: descents there are this many times longer.
FIRST_WINDOW = 2
FIRST_EFFORT = Effort()


class Sampler:
    """A `Tracker`: Gauss-Newton steps and then CMA-ES, both over rollouts; one serves all windows of a clip.

    Attributes:
        problem: the clip.
        simulator: of all rollouts but those of a draft.
    """

    def __init__(self, problem: Problem, threads: Threads = 0) -> None:
        """Make room for the plan's population."""
        self.problem, self._threads = problem, threads
        self.simulator = Simulator(problem.model, problem.plan.optimiser.population, threads)

    def prepare(self, windows: Sequence[Window], start: Handover) -> None:
        """Draft all windows, if the plan says so (`draft`)."""
        self.problem = drafted(self.problem, windows, start, self._threads)

    def solve(
        self, window: Window, handover: Handover, rng: np.random.Generator, effort: Effort = FIRST_EFFORT
    ) -> WindowResult:
        """See `Tracker`."""
        began, stepping, stepped = time.perf_counter(), self.simulator.seconds, self.simulator.steps
        plan = self.problem.plan.optimiser
        task = Task(self.problem, window, handover)
        descent = Descent.begin(task, self.simulator)
        trace, steps = [descent.loss], [self.simulator.steps]
        descent_steps = plan.descent_steps * (1 if window.index else FIRST_WINDOW) * effort.factor
        for _ in range(descent_steps):
            descent.step()
            trace.append(descent.loss)
            steps.append(self.simulator.steps)
        search, status = Search(descent, rng), WindowStatus.GENERATIONS
        for _ in range(plan.generations * effort.factor):
            search.generation()
            trace.append(search.loss)
            steps.append(self.simulator.steps)
            ended = search.ended(trace[-PATIENCE - 1 :])
            if ended is not None:
                status = ended
                break
        # The mean averages out the sampling noise of coordinates that have not converged.
        search.consider(search.es.mean[None])
        trace[-1] = search.loss
        committed = task.commit(search.x)
        return WindowResult(
            window=window,
            ctrl=committed.ctrl,
            states=committed.states,
            loss=search.loss,
            loss_terms=search.terms,
            trace=np.array(trace),
            steps=np.array(steps) - stepped,
            descent_steps=descent_steps,
            evaluations=round(descent.evaluations) + search.es.evaluations + 1,
            seconds=time.perf_counter() - began,
            stepping_s=self.simulator.seconds - stepping,
            status=status if np.isfinite(search.loss) else WindowStatus.FAILED,
            effort=effort,
            handover=committed.handover,
        )
