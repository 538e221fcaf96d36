"""Sampling-based trajectory optimisation with the simulator in the loop (Gärtner et al. 2022, section 3.2).

Per window: minimise the loss of a rollout over the knots of cubic B-splines that are added to the kinematic
control targets, by CMA-ES. Every sample is a whole rollout, so contacts, torque limits and falls are the
simulator's own.
"""

from __future__ import annotations

import time

import numpy as np

from simrecon import rollout, splines
from simrecon.cmaes import CMAES
from simrecon.engines.problem import Problem
from simrecon.engines.task import Task
from simrecon.rollout import Simulator
from simrecon.types import Handover, Window, WindowResult, WindowStatus


def start(problem: Problem) -> Handover:
    """Where the first window begins: kinematic pose, velocity by finite differences, knots at zero."""
    state = rollout.initial_state(problem.model, problem.qpos[0], problem.qvel0)
    count = splines.knot_count(problem.clock.steps * problem.clock.step_s, problem.plan.window.knot_spacing_s)
    return Handover(state, np.zeros((count, problem.model.nu)))


class Sampler:
    """CMA-ES over rollouts; one instance serves all windows of a clip."""

    def __init__(self, problem: Problem, threads: int = 0) -> None:
        """Make room for the plan's population."""
        self.problem = problem
        self.simulator = Simulator(problem.model, problem.plan.optimiser.population, threads)

    def solve(self, window: Window, handover: Handover, rng: np.random.Generator) -> WindowResult:
        """Optimise one window from the state and knots that the last one handed over.

        Args:
            window: which part of the clip.
            handover: exact state at its start, and knots so far.
            rng: random numbers for the samples.
        """
        began, stepping = time.perf_counter(), self.simulator.seconds
        plan = self.problem.plan.optimiser
        task = Task(self.problem, window, handover)
        mean = task.warm_start()
        es = CMAES(
            mean,
            plan.sigma_rad,
            scales=task.deviations() / plan.sigma_rad,
            population=plan.population,
            covariance=plan.covariance,  # type: ignore[arg-type]
            bounds=task.bounds(),
            rng=rng,
        )
        trace, status = [], WindowStatus.GENERATIONS
        best, best_x, best_terms = np.inf, mean, dict[str, float]()
        for generation in range(plan.generations):
            samples = es.ask()
            if generation == 0:
                samples[0] = mean
            terms, finite = task.evaluate(self.simulator, samples)
            total = np.where(finite, sum(terms.values()), np.inf)
            es.tell(samples, total)
            lowest = int(np.argmin(total))
            if total[lowest] < best:
                best, best_x = float(total[lowest]), samples[lowest].copy()
                best_terms = {name: float(value[lowest]) for name, value in terms.items()}
            trace.append(best)
            if es.converged(plan.tol_loss * best, plan.tol_sigma * plan.sigma_rad):
                status = WindowStatus.CONVERGED
                break
        # The mean averages out the sampling noise of coordinates that have not converged.
        terms, finite = task.evaluate(self.simulator, es.mean[None])
        loss = sum(float(value[0]) for value in terms.values()) if finite[0] else np.inf
        if loss < best:
            best, best_x = loss, es.mean.copy()
            best_terms = {name: float(value[0]) for name, value in terms.items()}
            trace[-1] = best
        if not np.isfinite(best):
            status = WindowStatus.FAILED
        return task.commit(
            best_x,
            loss=best,
            loss_terms=best_terms,
            trace=np.array(trace),
            evaluations=es.evaluations + 1,
            seconds=time.perf_counter() - began,
            stepping_s=self.simulator.seconds - stepping,
            status=status,
        )
