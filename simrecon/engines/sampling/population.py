"""Rollouts about the end of a window's search: how else force and contact might be at the same loss.

The draws are from the Gaussian of the loss's curvature, so wide that they raise the loss by a share of it,
and each is really simulated. It counts by its loss, exp(-(L - L*) / (share L*)).
"""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.contact import rules
from simrecon.engines.problem import FEET, Problem
from simrecon.engines.sampling.starts import RISE, within
from simrecon.engines.sampling.task import Task
from simrecon.optim.gauss_newton import Quadratic
from simrecon.sim.address import locate
from simrecon.sim.felt import Felt
from simrecon.sim.rollout import Simulator, Threads
from simrecon.types import Array, Spread

LEAST = 1e-6
"""Of a loss, below which no share of it is taken."""


class Population:
    """Draws of each window, and what the scene does to every part of the body in them.

    Attributes:
        draws: how many.
    """

    def __init__(self, problem: Problem, threads: Threads = 0) -> None:
        """Make room for the plan's draws."""
        self.draws = problem.plan.optimiser.draws
        model = problem.model
        self._geoms = np.flatnonzero(locate(model).own_geoms(model))
        names = [model.geom(geom).name for geom in self._geoms]
        self._simulator = Simulator(model, self.draws + 1, threads, Felt.of_geoms(problem.mjcf, names))
        self._feet = np.array([_below(model, foot)[model.geom_bodyid[self._geoms]] for foot in FEET])

    def spread(
        self, task: Task, simulator: Simulator, x: Array, quadratic: Quadratic, rng: np.random.Generator
    ) -> Spread:
        """The spread over the frames that a window keeps.

        Args:
            task: the window.
            simulator: of its loss.
            x: (n,) where the search ended.
            quadratic: the loss near there.
            rng: of the draws.
        """
        rise = RISE * max(_losses(task, simulator, x[None])[0], LEAST)
        moves = rng.standard_normal((self.draws, len(x))) @ quadratic.root_covariance(rise, 1.0)
        samples = np.concatenate((x[None], within(task, x + moves * task.deviations())))
        losses = _losses(task, simulator, samples)
        weights = np.exp(-np.maximum(losses - losses[0], 0.0) / rise)  # (P,), of infinite losses 0
        weights /= weights.sum()
        window, stride = task.window, task.problem.clock.stride
        steps = np.arange(0, window.commit_step - window.start_step + 1, stride)
        control = task.control(samples)[:, : steps[-1] + 1]
        force = self._simulator.run(task.states(samples), control, steps).wrenches[
            :, 1:, :, 3:
        ]  # (P, F, C, 3)
        force[weights == 0.0] = 0.0
        touch = np.tensordot(weights, rules.loaded(np.linalg.norm(force, axis=-1)).astype(float), 1)
        whole = force.sum(axis=2, keepdims=True)
        feet = [force[:, :, foot].sum(axis=2, keepdims=True) for foot in self._feet]
        shown = np.concatenate((*feet, whole), axis=2)  # (P, F, 3, 3)
        mean = np.tensordot(weights, shown, 1)
        return Spread(np.sqrt(np.tensordot(weights, np.square(shown - mean), 1)), touch)


def _losses(task: Task, simulator: Simulator, samples: Array) -> Array:
    """Losses (P,) of unknowns (P, n), infinite where a rollout diverged."""
    values, finite = task.evaluate(simulator, samples)
    return np.asarray(np.where(finite, sum(values.values()), np.inf))


def _below(model: mujoco.MjModel, name: str) -> Array:
    """Which bodies hang on one, itself included, (nbody,) bool; none if there is no such body."""
    root = model.body(locate(model).prefix + name).id
    found = np.zeros(model.nbody, bool)
    for body in range(root, model.nbody):  # parents come first
        found[body] = body == root or (body > root and found[model.body_parentid[body]])
    return found
