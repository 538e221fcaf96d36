"""Sampling-based trajectory optimisation with the simulator in the loop (Gärtner et al. 2022, section 3.2).

Per window: minimise the loss of a rollout over the knots of cubic B-splines that are added to the kinematic
control targets, by CMA-ES. Every sample is a whole rollout, so contacts, torque limits and falls are the
simulator's own.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon import losses, rollout, splines
from simrecon.cmaes import CMAES
from simrecon.engines.problem import Problem
from simrecon.rollout import Rollouts, Simulator
from simrecon.types import Array, Handover, IntArray, Window, WindowResult, WindowStatus


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
        task = _Task(self.problem, window, handover)
        mean = task.warm_start()
        es = CMAES(
            mean.ravel(),
            plan.sigma_rad,
            population=plan.population,
            covariance=plan.covariance,  # type: ignore[arg-type]
            bounds=np.tile([-plan.bound_rad, plan.bound_rad], (mean.size, 1)),
            rng=rng,
        )
        trace, status = [], WindowStatus.GENERATIONS
        best, best_knots, best_terms = np.inf, mean, dict[str, float]()
        for generation in range(plan.generations):
            samples = es.ask()
            if generation == 0:
                samples[0] = mean.ravel()
            terms, finite = task.evaluate(self.simulator, samples)
            total = np.where(finite, sum(terms.values()), np.inf)
            es.tell(samples, total)
            lowest = int(np.argmin(total))
            if total[lowest] < best:
                best, best_knots = float(total[lowest]), samples[lowest].reshape(mean.shape)
                best_terms = {name: float(value[lowest]) for name, value in terms.items()}
            trace.append(best)
            if es.converged(plan.tol_loss * best, plan.tol_sigma * plan.sigma_rad):
                status = WindowStatus.CONVERGED
                break
        if not np.isfinite(best):
            status = WindowStatus.FAILED
        return task.commit(
            best_knots,
            loss=best,
            loss_terms=best_terms,
            trace=np.array(trace),
            evaluations=es.evaluations,
            seconds=time.perf_counter() - began,
            stepping_s=self.simulator.seconds - stepping,
            status=status,
        )


@dataclass(frozen=True, eq=False)
class _Targets:
    """Targets of the loss at the F frames of a window, the first included."""

    orientations: Array
    com_m: Array
    points_m: Array
    rays: Array
    scores: Array


class _Task:
    """One window as a function of its knots."""

    def __init__(self, problem: Problem, window: Window, handover: Handover) -> None:
        self.problem, self.window, self.handover = problem, window, handover
        clock, spacing = problem.clock, problem.plan.window.knot_spacing_s
        first_s, last_s = window.start_step * clock.step_s, window.end_step * clock.step_s
        self.knots = splines.support(first_s, last_s, spacing)
        count = self.knots.stop - self.knots.start
        # one step more than the window, for a rollout's derived fields lag by one
        times_s = np.arange(window.start_step, window.end_step + 1) * clock.step_s
        self.basis = splines.basis(
            np.minimum(times_s, last_s), spacing, count, self.knots.start * spacing
        )  # (N + 1, Q)
        self.base = problem.targets_rad[window.start_step : window.end_step + 1]  # (N + 1, nu)
        self.frames = problem.frames(window)
        self.at_steps: IntArray = self.frames[1:] * clock.stride - window.start_step
        rows = self.frames
        self.targets = _Targets(
            problem.orientations[rows],
            problem.com_m[rows],
            problem.points_m[rows],
            problem.rays[rows],
            problem.scores[rows],
        )
        self.now = self._now()

    def _now(self) -> Rollouts:
        """The window's first frame as it stands, (1, 1, …), in front of every rollout."""
        model = self.problem.model
        data = rollout.forward(model, self.handover.state)
        return Rollouts(
            data.qpos[None, None].copy(),
            data.site_xpos[None, None].copy(),
            data.subtree_com[None, None, 1].copy(),
            np.ones(1, dtype=bool),
        )

    def warm_start(self) -> Array:
        """Knots (Q, nu): of the overlap as the last window left them, then all as the last known one."""
        knots = self.handover.knots_rad[self.knots].copy()
        if self.window.index:
            reached = splines.support(
                self.window.start_step * self.problem.clock.step_s,
                self._previous_end_s(),
                self.problem.plan.window.knot_spacing_s,
            ).stop
            known = min(max(reached - self.knots.start, 1), len(knots))
            knots[known:] = knots[known - 1]
        return knots

    def _previous_end_s(self) -> float:
        overlap = self.problem.plan.window.overlap_s
        return min(
            self.window.start_step * self.problem.clock.step_s + overlap,
            self.window.end_step * self.problem.clock.step_s,
        )

    def control(self, knots: Array) -> Array:
        """Control (P, N + 1, nu) of knots (P, Q, nu)."""
        ctrl: Array = self.base + self.basis @ knots
        return ctrl

    def evaluate(self, simulator: Simulator, samples: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
        """Weighted loss terms (P,) by name of samples (P, Q · nu), and which rollouts stayed finite."""
        ctrl = self.control(samples.reshape(len(samples), -1, self.problem.model.nu))
        rolled = simulator.run(self.handover.state, ctrl, self.at_steps)
        with np.errstate(all="ignore"):
            terms = self._terms(rolled)
        finite = rolled.finite & np.isfinite(sum(terms.values()))
        return terms, finite

    def _terms(self, rolled: Rollouts) -> dict[str, Array]:
        problem, target, weights = self.problem, self.targets, self.problem.plan.loss
        count = len(rolled.qpos)

        def whole(now: Array, later: Array) -> Array:
            return np.concatenate((np.broadcast_to(now, (count, *now.shape[1:])), later), axis=1)

        com = whole(self.now.com_m, rolled.com_m)  # (P, F, 3)
        points = rolled.points_m[:, :, problem.point_rows]  # (P, F - 1, M, 3)
        orientations = rolled.qpos[..., 3:].reshape(*rolled.qpos.shape[:2], -1, 4)  # (P, F - 1, 17, 4)
        terms = {
            "com_position": losses.com_position(com, target.com_m),
            "com_velocity": losses.com_velocity(com, target.com_m, problem.interval_s),
        }
        if weights.pose:
            terms["pose"] = losses.pose(orientations, target.orientations[1:])
        if weights.landmark:
            terms["landmark"] = losses.landmark(points, target.points_m[1:])
        if weights.reprojection and problem.world_to_camera is not None:
            terms["reprojection"] = losses.reprojection(
                points, target.rays[1:], target.scores[1:], problem.world_to_camera
            )
        if weights.joint_limit:
            terms["joint_limit"] = losses.joint_limit(losses.joint_rotvecs(orientations), problem.limits_rad)
        if weights.prior:
            terms["prior"] = losses.prior(problem.prior.latent(orientations[..., 1:, :]))
        if weights.total_variation:
            joints = whole(
                self.now.points_m[:, :, problem.point_rows[problem.joint_rows]],
                points[:, :, problem.joint_rows],
            )
            terms["total_variation"] = losses.total_variation(joints)
        return {name: getattr(weights, name) * value for name, value in terms.items()}

    def commit(self, knots: Array, **result: object) -> WindowResult:
        """Step the window's first part for good under the best knots, and hand over."""
        kept = self.window.commit_step - self.window.start_step
        ctrl = self.control(knots[None])[0, :kept]
        states = rollout.replay(self.problem.model, self.handover.state, ctrl)
        knots_so_far = self.handover.knots_rad.copy()
        knots_so_far[self.knots] = knots
        return WindowResult(
            window=self.window,
            ctrl=ctrl,
            states=states,
            handover=Handover(states[-1], knots_so_far),
            **result,  # type: ignore[arg-type]
        )
