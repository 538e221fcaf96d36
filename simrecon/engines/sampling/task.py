"""One window as a function of its unknowns: the knots, and for the first window the state it starts from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simrecon.engines.problem import Problem
from simrecon.engines.sampling import terms as loss_terms
from simrecon.engines.sampling.terms import Seen, Targets
from simrecon.geometry import splines
from simrecon.sim import rollout
from simrecon.sim.address import locate
from simrecon.sim.felt import Felt
from simrecon.sim.rollout import Rollouts, Simulator
from simrecon.sim.state import displace, simulate
from simrecon.types import Array, Handover, IntArray, Window

# How far the unknowns may go, in initial standard deviations of the first state.
START_BOUND = 10.0


@dataclass(frozen=True, eq=False)
class Committed:
    """The first part of a window, stepped for good.

    Attributes:
        ctrl: (K, nu) control. states: (K + 1, nstate) full states, the first included.
        handover: to the next window.
    """

    ctrl: Array
    states: Array
    handover: Handover


class Task:
    """One window. Unknowns x (n,): knots (Q, nu), then in the first one offsets of pose and velocity.

    Attributes:
        window: which part of the clip.
        at_steps: (F,) steps that the loss looks at, the first one included.
        terms: of the loss.
    """

    def __init__(
        self, problem: Problem, window: Window, handover: Handover, *, begins: bool | None = None
    ) -> None:
        """Lay out a window that starts at the exact state of `handover`, warm-started with its knots.

        Args:
            problem: the clip.
            window: which part of it.
            handover: what the window before passed on.
            begins: whether a simulation begins with it, whose first state is free; None: if it is the first.
        """
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
        frames = problem.frames(window)
        self.at_steps: IntArray = frames * clock.stride - window.start_step
        self.terms = loss_terms.of_window(problem, len(frames))
        self._targets = Targets.at(problem, frames)
        optimiser = problem.plan.optimiser
        begins = window.index == 0 if begins is None else begins
        free = begins and (optimiser.start_pose > 0 or optimiser.start_velocity > 0)
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

    def knots_of(self, x: Array) -> Array:
        """Knots (..., Q, nu) of unknowns (..., n)."""
        return x[..., : self.shape[0] * self.shape[1]].reshape(*x.shape[:-1], *self.shape)

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
        ctrl: Array = self._base + self._basis @ self.knots_of(samples)
        return ctrl

    def states(self, samples: Array) -> Array:
        """States (P, nstate) from which rollouts of the unknowns (P, n) start."""
        states = np.repeat(self.handover.state[None], len(samples), axis=0)
        if self._free:
            model, own = self.problem.model, self._free // 2
            offsets = np.zeros((2, len(samples), model.nv))
            offsets[..., :own] = samples[:, -self._free :].reshape(-1, 2, own).swapaxes(0, 1)
            displace(model, states, *offsets)
        return states

    def knot_weights(self) -> Array:
        """How much of each knot is in the control of each step of the window, (N, Q)."""
        return self._basis[:-1]

    def evaluate(self, simulator: Simulator, samples: Array) -> tuple[dict[str, Array], NDArray[np.bool_]]:
        """Weighted loss terms (P,) by name of unknowns (P, n), and which rollouts stayed finite."""

        def measured(part: slice) -> tuple[dict[str, Array], NDArray[np.bool_]]:
            own = samples[part]
            rolled = simulator.run(self.states(own), self.control(own), self.at_steps)
            with np.errstate(all="ignore"):
                seen = self.seen(rolled)
                values = {term.name: term.weight * term.value(seen) for term in self.terms}
            return values, rolled.finite & np.isfinite(sum(values.values()))

        parts = simulator.each(measured, rollout.pieces(len(samples), simulator.population))
        return (
            {term.name: np.concatenate([values[term.name] for values, _ in parts]) for term in self.terms},
            np.concatenate([finite for _, finite in parts]),
        )

    def seen(self, rolled: Rollouts) -> Seen:
        """What the terms look at, of rollouts at the frames of the loss."""
        return Seen.of(rolled, self.problem.point_rows, self._targets)

    def commit(self, x: Array) -> Committed:
        """Step the window's first part for good under the unknowns x (n,), and hand over."""
        kept = self.window.commit_step - self.window.start_step
        ctrl = self.control(x[None])[0, :kept]
        states = simulate(self.problem.model, self.states(x[None])[0], ctrl)
        return Committed(ctrl, states, Handover(states[-1], self.knots_of(x).copy(), self.knots.start))


def simulator(problem: Problem, threads: rollout.Threads = 0) -> Simulator:
    """A simulator of a clip's rollouts that shows all that the loss looks at."""
    loss = problem.plan.loss
    feet = (loss.force or loss.moment) and problem.pushed is not None
    feels = feet or (loss.borne and problem.borne is not None)
    prefix = locate(problem.model).prefix
    felt = Felt.of(problem.mjcf, [prefix + segment for segment in problem.felt]) if feels else None
    return Simulator(problem.model, problem.plan.optimiser.population, threads, felt)
