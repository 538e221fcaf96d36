"""The tracker that samples: descents and CMA-ES on each window, perhaps after a draft of all.

Per window: minimise the loss of a rollout over the knots of cubic B-splines that are added to the kinematic
control targets. All that is tried is simulated, so contacts, torque limits and falls are the simulator's own.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.course import Course
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.draft import drafted
from simrecon.engines.sampling.population import Population
from simrecon.engines.sampling.search import Search
from simrecon.engines.sampling.starts import descend
from simrecon.engines.sampling.task import Task, simulator
from simrecon.sim.rollout import Threads
from simrecon.types import Effort, Handover, Window, WindowResult, WindowStatus

# The first window has no warm start: descents there are this many times longer.
FIRST_WINDOW = 2
FIRST_EFFORT = Effort()


class Sampler:
    """A `Tracker`: Gauss-Newton steps and then CMA-ES, both over rollouts; one serves all windows of a clip.

    Attributes:
        problem: the clip.
        simulator: of all rollouts but those of a draft.
        population: of what bands are made; None: the plan asks for none.
    """

    def __init__(self, problem: Problem, threads: Threads = 0) -> None:
        """Make room for the plan's population."""
        self.problem, self._threads = problem, threads
        self.simulator = simulator(problem, threads)
        self.population = Population(problem, threads) if problem.plan.optimiser.draws else None

    def prepare(self, windows: Sequence[Window], start: Handover) -> None:
        """Draft all windows, if the plan says so (`draft`)."""
        self.problem = drafted(self.problem, windows, start, self._threads)

    def solve(
        self, window: Window, handover: Handover, rng: np.random.Generator, effort: Effort = FIRST_EFFORT
    ) -> WindowResult:
        """See `Tracker`."""
        began, stepping, stepped = time.perf_counter(), self.simulator.seconds, self.simulator.steps
        plan = self.problem.plan.optimiser
        begins = not len(handover.knots_rad)  # of a simulation, after a gap or at the start of the clip
        task = Task(self.problem, window, handover, begins=begins)
        course = Course()
        most = plan.descent_steps * effort.factor * (FIRST_WINDOW if begins else 1)
        descent = descend(task, self.simulator, rng, plan.starts * effort.factor, most, course)
        descent_steps = len(course.losses) - 1
        best: Descent | Search = descent
        status = WindowStatus.DESCENT if descent_steps == most else WindowStatus.AT_REST
        if plan.generations:
            best, status = self._sampled(descent, rng, plan.generations * effort.factor, course)
        committed = task.commit(best.x)
        spread = None
        if self.population is not None and descent.quadratic is not None and np.isfinite(best.loss):
            spread = self.population.spread(task, self.simulator, best.x, descent.quadratic, rng)
        return WindowResult(
            window=window,
            ctrl=committed.ctrl,
            states=committed.states,
            loss=best.loss,
            loss_terms=best.terms,
            trace=np.array(course.losses),
            steps=np.array(course.steps) - stepped,
            descent_steps=descent_steps,
            evaluations=course.evaluations,
            seconds=time.perf_counter() - began,
            stepping_s=self.simulator.seconds - stepping,
            status=status if np.isfinite(best.loss) else WindowStatus.FAILED,
            effort=effort,
            handover=committed.handover,
            spread=spread,
        )

    def _sampled(
        self, descent: Descent, rng: np.random.Generator, generations: int, course: Course
    ) -> tuple[Search, WindowStatus]:
        """CMA-ES from the end of a descent, and the rule that ended it."""
        search, status = Search(descent, rng), WindowStatus.GENERATIONS
        since = len(course.losses) - 1
        for _ in range(generations):
            search.generation()
            course.add(search.loss, self.simulator.steps)
            ended = search.ended(course, since)
            if ended is not None:
                status = ended
                break
        # The mean averages out the sampling noise of coordinates that have not converged.
        search.consider(search.es.mean[None])
        course.losses[-1] = search.loss
        course.evaluations += search.es.evaluations + 1
        return search, status
