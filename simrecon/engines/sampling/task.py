"""One window as a function of its unknowns: the knots, and for the first window the state it starts from."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from simrecon.engines.problem import Problem
from simrecon.engines.sampling import losses
from simrecon.geometry import rotations, splines
from simrecon.optim.gauss_newton import Term
from simrecon.sim import rollout
from simrecon.sim.address import locate
from simrecon.sim.rollout import Rollouts, Simulator
from simrecon.sim.state import component, simulate
from simrecon.types import Array, Handover, IntArray, Window, WindowResult

# How far the unknowns may go, in initial standard deviations of the first state.
START_BOUND = 10.0
# Frames before its own that a term of the loss looks at, at most: those of the total variation.
DIFFERENCES = 3


@dataclass(frozen=True, eq=False)
class _Targets:
    """Targets of the loss at the F frames of a window, the first included."""

    orientations: Array
    com_m: Array
    points_m: Array
    rays: Array
    scores: Array
    world_to_camera: Array | None

    def later(self, since: int) -> _Targets:
        """Those of the frames from `since` on."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **{name: value[since:] for name, value in values.items() if value is not None})


class Task:
    """One window. Unknowns x (n,): knots (Q, nu), then in the first one offsets of pose and velocity.

    Attributes:
        window: which part of the clip.
        at_steps: (F,) steps that the loss looks at, the first one included.
    """

    def __init__(self, problem: Problem, window: Window, handover: Handover) -> None:
        """Lay out a window that starts at the exact state of `handover`, warm-started with its knots."""
        self.problem, self.window, self.handover = problem, window, handover
        clock, spacing = problem.clock, problem.plan.window.knot_spacing_s
        first_s, last_s = window.start_step * clock.step_s, window.end_step * clock.step_s
        self.knots = splines.support(first_s, last_s, spacing)
        self.shape = (self.knots.stop - self.knots.start, problem.model.nu)
        # one step more than the window, for a rollout's derived fields lag by one
        times_s = np.arange(window.start_step, window.end_step + 1) * clock.step_s
        at_s = np.minimum(times_s, last_s)
        self._basis = splines.basis(at_s, spacing, self.shape[0], self.knots.start * spacing)  # (N + 1, Q)
        self._base = problem.targets_rad[window.start_step : window.end_step + 1]  # (N + 1, nu)
        rows = problem.frames(window)
        self.at_steps: IntArray = rows * clock.stride - window.start_step
        self._targets = _Targets(
            problem.orientations[rows],
            problem.com_m[rows],
            problem.points_m[rows],
            problem.rays[rows],
            problem.scores[rows],
            None if problem.world_to_camera is None else problem.world_to_camera[rows],
        )
        self._prior_rows, self._prior_share = _subset(len(rows), problem)
        optimiser = problem.plan.optimiser
        free = window.index == 0 and (optimiser.start_pose > 0 or optimiser.start_velocity > 0)
        self._free = 2 * locate(problem.model).nv if free else 0

    def warm_start(self) -> Array:
        """Unknowns (n,): knots of the overlap as they were left, then as drafted, or as the last known."""
        knots = self.problem.draft_rad[self.knots].copy()
        if self.window.index:
            clock, plan = self.problem.clock, self.problem.plan.window
            start_s, end_s = (step * clock.step_s for step in (self.window.start_step, self.window.end_step))
            reached = splines.support(start_s, min(start_s + plan.overlap_s, end_s), plan.knot_spacing_s).stop
            known = min(max(reached - self.knots.start, 1), len(knots))
            before = self.handover.knots_rad[self.knots.start - self.handover.first :][:known]
            knots[: len(before)] = before
            if not knots[known:].any():
                knots[known:] = knots[known - 1]
        return np.concatenate((knots.ravel(), np.zeros(self._free)))

    def deviations(self) -> Array:
        """Initial standard deviations (n,) of the unknowns."""
        optimiser = self.problem.plan.optimiser
        knots = np.full(self.shape[0] * self.shape[1], optimiser.sigma_rad)
        start = [max(value, 1e-9) for value in (optimiser.start_pose, optimiser.start_velocity)]
        return np.concatenate((knots, np.repeat(start, self._free // 2)))

    def bounds(self) -> Array:
        """Lowest and highest value (n, 2) of the unknowns."""
        highest = START_BOUND * self.deviations()
        highest[: self.shape[0] * self.shape[1]] = self.problem.plan.optimiser.bound_rad
        return np.stack((-highest, highest), axis=1)

    def control(self, samples: Array) -> Array:
        """Control (P, N + 1, nu) of unknowns (P, n)."""
        knots = samples[:, : self.shape[0] * self.shape[1]].reshape(-1, *self.shape)
        ctrl: Array = self._base + self._basis @ knots
        return ctrl

    def states(self, samples: Array) -> Array:
        """States (P, nstate) from which rollouts of the unknowns (P, n) start."""
        states = np.repeat(self.handover.state[None], len(samples), axis=0)
        if self._free:
            model, own = self.problem.model, self._free // 2
            qpos = component(model, states, mujoco.mjtState.mjSTATE_QPOS)
            qvel = component(model, states, mujoco.mjtState.mjSTATE_QVEL)
            offsets = np.zeros((len(samples), 2, model.nv))
            offsets[..., :own] = samples[:, -self._free :].reshape(-1, 2, own)
            qvel += offsets[:, 1]
            for row, offset in zip(qpos, np.ascontiguousarray(offsets[:, 0]), strict=True):
                mujoco.mj_integratePos(model, row, offset, 1.0)
        return states

    def evaluate(self, simulator: Simulator, samples: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
        """Weighted loss terms (P,) by name of unknowns (P, n), and which rollouts stayed finite."""

        def measured(part: slice) -> tuple[dict[str, Array], NDArray[np.bool_]]:
            own = samples[part]
            rolled = simulator.run(self.states(own), self.control(own), self.at_steps)
            with np.errstate(all="ignore"):
                terms = self._terms(rolled)
            return terms, rolled.finite & np.isfinite(sum(terms.values()))

        parts = simulator.each(measured, rollout.pieces(len(samples), simulator.population))
        names = parts[0][0]
        return (
            {name: np.concatenate([terms[name] for terms, _ in parts]) for name in names},
            np.concatenate([finite for _, finite in parts]),
        )

    def _terms(self, rolled: Rollouts) -> dict[str, Array]:
        problem, target, weights = self.problem, self._targets, self.problem.plan.loss
        points = rolled.points_m[:, :, problem.point_rows]  # (P, F, M, 3)
        orientations = rolled.qpos[..., 3:].reshape(*rolled.qpos.shape[:2], -1, 4)  # (P, F, 17, 4)
        terms = {
            "com_position": losses.com_position(rolled.com_m, target.com_m),
            "com_velocity": losses.com_velocity(rolled.com_m, target.com_m, problem.interval_s),
        }
        if weights.pose:
            terms["pose"] = losses.pose(orientations, target.orientations)
        if weights.landmark:
            terms["landmark"] = losses.landmark(points, target.points_m, problem.point_weights)
        if weights.landmark_velocity:
            terms["landmark_velocity"] = losses.landmark_velocity(
                points, target.points_m, problem.point_weights, problem.interval_s
            )
        if weights.reprojection and target.world_to_camera is not None:
            terms["reprojection"] = losses.reprojection(
                points, target.rays, target.scores, target.world_to_camera
            )
        if weights.joint_limit:
            terms["joint_limit"] = losses.joint_limit(losses.joint_rotvecs(orientations), problem.limits_rad)
        if weights.prior:
            seen = orientations[:, self._prior_rows, 1:]
            terms["prior"] = losses.prior(problem.prior.latent(seen)) * self._prior_share
        if weights.total_variation:
            terms["total_variation"] = losses.total_variation(points[:, :, problem.joint_rows])
        return {name: getattr(weights, name) * value for name, value in terms.items()}

    def residuals(self, rolled: Rollouts, since: int = 0) -> list[Term]:
        """The terms of the loss as vectors, for Gauss-Newton steps; of rollouts at frames from `since` on."""
        problem, weights = self.problem, self.problem.plan.loss
        target = self._targets.later(since)
        points = rolled.points_m[:, :, problem.point_rows]  # (P, F, M, 3)
        orientations = rolled.qpos[..., 3:].reshape(*rolled.qpos.shape[:2], -1, 4)  # (P, F, 17, 4)
        com_off, off = rolled.com_m - target.com_m, points - target.points_m
        rate = 1.0 / problem.interval_s
        terms = [
            Term(com_off, weights.com_position),
            Term(rate * np.diff(com_off, axis=1), weights.com_velocity),
            Term(off, weights.landmark * problem.point_weights),
        ]
        if weights.landmark_velocity:
            terms.append(Term(rate * np.diff(off, axis=1), weights.landmark_velocity * problem.point_weights))
        if weights.pose:
            turn = rotations.log(rotations.multiply(rotations.conjugate(target.orientations), orientations))
            terms.append(Term(0.5 * turn, weights.pose, np.ones_like, floor=0.025))
        if weights.reprojection and target.world_to_camera is not None:
            image = losses.image_plane(points, target.world_to_camera) - target.rays
            terms.append(Term(image, weights.reprojection * target.scores, np.ones_like, floor=0.005))
        if weights.joint_limit:
            over = losses.limit_excess(losses.joint_rotvecs(orientations), problem.limits_rad)
            terms.append(Term(over[..., None], weights.joint_limit, losses.joint_limit_slope, floor=0.03))
        if weights.prior:
            rows = self._prior_rows[self._prior_rows >= since] - since
            latent = problem.prior.latent(orientations[:, rows, 1:])
            code = np.zeros((*orientations.shape[:2], latent.shape[-1]))
            code[:, rows] = latent
            terms.append(Term(code, weights.prior * self._prior_share, np.ones_like))
        if weights.total_variation:
            jerk = np.diff(points[:, :, problem.joint_rows], n=DIFFERENCES, axis=1)
            share = weights.total_variation / jerk.shape[2]
            terms.append(Term(jerk[..., None], share, np.ones_like, floor=0.001))
        return terms

    def started(self, rows: IntArray) -> IntArray:
        """First step (len(rows),) on which the unknowns `rows` act."""
        acts = (self._basis[:-1] > 0).argmax(axis=0)  # (Q,)
        knot = rows // self.shape[1]
        return np.where(knot < len(acts), acts[np.minimum(knot, len(acts) - 1)], 0)

    def commit(self, x: Array, **result: object) -> WindowResult:
        """Step the window's first part for good under the unknowns x (n,), and hand over."""
        kept = self.window.commit_step - self.window.start_step
        ctrl = self.control(x[None])[0, :kept]
        states = simulate(self.problem.model, self.states(x[None])[0], ctrl)
        knots = x[: self.shape[0] * self.shape[1]].reshape(self.shape).copy()
        return WindowResult(
            window=self.window,
            ctrl=ctrl,
            states=states,
            handover=Handover(states[-1], knots, self.knots.start),
            **result,  # type: ignore[arg-type]
        )


def _subset(frames: int, problem: Problem) -> tuple[IntArray, float]:
    """Of the F frames of the loss, those that the prior looks at, and how many each stands for."""
    stride = max(1, round(1 / (problem.plan.loss.prior_rate_hz * problem.interval_s)))
    rows = np.arange(frames - 1, -1, -stride)[::-1]
    return rows, frames / len(rows)
