"""Sampling-based trajectory optimisation with the simulator in the loop (Gärtner et al. 2022, section 3.2).

Per window: minimise the loss of a rollout over the knots of cubic B-splines that are added to the kinematic
control targets, by CMA-ES. Every sample is a whole rollout, so contacts, torque limits and falls are the
simulator's own. A few Gauss-Newton steps on rollouts (`descent`) come before, and give the samples their
shape.
"""

from __future__ import annotations

import time

import numpy as np

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.descent import Descent
from simrecon.engines.sampling.task import Task
from simrecon.optim.cmaes import CMAES
from simrecon.sim.rollout import Simulator, Threads
from simrecon.sim.state import initial_state
from simrecon.types import Array, Effort, Handover, Window, WindowResult, WindowStatus

# The first window has no warm start: descents there are this many times longer.
FIRST_WINDOW = 2
# Generations over which the best loss is looked at, to tell whether it is at rest.
PATIENCE = 10
FIRST_EFFORT = Effort()


def start(problem: Problem) -> Handover:
    """Where the first window begins: kinematic pose, velocity by finite differences, no knots yet."""
    state = initial_state(problem.model, problem.qpos[0], problem.qvel0)
    return Handover(state, np.zeros((0, problem.model.nu)))


class Sampler:
    """Gauss-Newton steps and then CMA-ES, both over rollouts; one instance serves all windows of a clip."""

    def __init__(self, problem: Problem, threads: Threads = 0) -> None:
        """Make room for the plan's population."""
        self.problem = problem
        self.simulator = Simulator(problem.model, problem.plan.optimiser.population, threads)

    def solve(
        self, window: Window, handover: Handover, rng: np.random.Generator, effort: Effort = FIRST_EFFORT
    ) -> WindowResult:
        """Optimise one window from the state and knots that the last one handed over.

        Args:
            window: which part of the clip.
            handover: exact state at its start, and knots so far.
            rng: random numbers for the samples.
            effort: how much more than usual is spent, after a fall.
        """
        began, stepping, stepped = time.perf_counter(), self.simulator.seconds, self.simulator.steps
        plan = self.problem.plan.optimiser
        task = Task(self.problem, window, handover)
        descent = Descent.begin(task, self.simulator)
        trace, steps = [descent.loss], [self.simulator.steps]
        descents = plan.descent_steps * (1 if window.index else FIRST_WINDOW) * effort.factor
        for _ in range(descents):
            descent.step()
            trace.append(descent.loss)
            steps.append(self.simulator.steps)
        search = _Search(descent, rng)
        status = WindowStatus.GENERATIONS
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
        if not np.isfinite(search.loss):
            status = WindowStatus.FAILED
        return task.commit(
            search.x,
            loss=search.loss,
            loss_terms=search.terms,
            trace=np.array(trace),
            steps=np.array(steps) - stepped,
            descent_steps=descents,
            evaluations=round(descent.evaluations) + search.es.evaluations + 1,
            seconds=time.perf_counter() - began,
            stepping_s=self.simulator.seconds - stepping,
            status=status,
            effort=effort,
        )


class _Search:
    """CMA-ES around the end of a descent, in coordinates in which the loss is round there.

    Unknowns are x = x0 + R z with the symmetric root R of a covariance that comes from the curvature of the
    loss (`Quadratic.root_covariance`), so that sigma = 1 and a diagonal covariance of z begin well. Without a
    descent R holds the plan's deviations.
    """

    def __init__(self, descent: Descent, rng: np.random.Generator) -> None:
        task, plan = descent.task, descent.task.problem.plan.optimiser
        self.task, self.simulator, self.tolerance = task, descent.simulator, plan.tol_loss
        self.tol_sigma = plan.tol_sigma
        self.x, self.loss, self.terms = descent.x, descent.loss, descent.terms
        self._origin, self._scale, self._root = descent.x, task.deviations(), None
        if descent.quadratic is not None:
            self._root = descent.quadratic.root_covariance(plan.spread * descent.loss, 1.0)
        self._low, self._high = task.bounds().T
        self.es = CMAES(
            np.zeros(len(descent.x)),
            1.0,
            population=plan.population,
            covariance=plan.covariance,  # type: ignore[arg-type]
            rng=rng,
        )

    def generation(self) -> None:
        """Sample, simulate, learn."""
        samples = self.es.ask()
        self.es.tell(samples, self.consider(samples))

    def consider(self, samples: Array) -> Array:
        """Losses (P,) of samples z (P, n); the best one is kept if nothing before was better."""
        moves = samples if self._root is None else samples @ self._root
        x = np.clip(self._origin + moves * self._scale, self._low, self._high)
        terms, finite = self.task.evaluate(self.simulator, x)
        total: Array = np.where(finite, sum(terms.values()), np.inf)
        lowest = int(np.argmin(total))
        if total[lowest] < self.loss:
            self.loss, self.x = float(total[lowest]), x[lowest].copy()
            self.terms = {name: float(value[lowest]) for name, value in terms.items()}
        return total

    def ended(self, recent: list[float]) -> WindowStatus | None:
        """The rule that ends the window now: the best loss of the last `PATIENCE` generations, or sigma."""
        if self.es.sigma <= self.tol_sigma:
            return WindowStatus.SMALL_STEPS
        enough = len(recent) > PATIENCE and self.tolerance > 0.0
        if enough and recent[0] - recent[-1] <= self.tolerance * recent[-1]:
            return WindowStatus.AT_REST
        return None
