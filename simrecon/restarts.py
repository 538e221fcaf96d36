"""CMA-ES that starts anew with twice the population whenever it comes to rest (IPOP).

Source: A. Auger and N. Hansen, "A Restart CMA Evolution Strategy With Increasing Population Size", CEC 2005,
whose sections are given below. Axes: P samples of a generation, n variables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from simrecon.cmaes import CMAES, Covariance, State
from simrecon.types import Array

__all__ = ["Restarts"]

_GROWTH = 2  # of the population, section 2


class Restarts:
    """A row of CMA-ES runs with `ask` and `tell` of one; the best sample of all of them is kept.

    A run ends when the range of the best losses of its recent generations is at most `tol_loss`, or its
    largest standard deviation, in units of `scales`, at most `tol_sigma` (section 2). The next one has twice
    the population, the first step size, and a mean drawn from N(mean, (sigma scales)²) of the first one, cut
    at the bounds.

    Args:
        mean, sigma, scales, population, covariance, bounds: of the first run, as in `CMAES`.
        tol_loss, tol_sigma: see above; as in `CMAES.converged`.
        generations: how many are recent; those of `CMAES.converged` if None.
        seed: of all random numbers.

    Raises:
        ValueError: a shape or a value that can't be used.
    """

    def __init__(
        self,
        mean: Array,
        sigma: float,
        *,
        scales: Array | None = None,
        population: int | None = None,
        covariance: Covariance = "diagonal",
        bounds: Array | None = None,
        tol_loss: float,
        tol_sigma: float,
        generations: int | None = None,
        seed: int,
    ) -> None:
        self.run = CMAES(
            mean,
            sigma,
            scales=scales,
            population=population,
            covariance=covariance,
            bounds=bounds,
            rng=np.random.default_rng([seed, 0]),
        )
        self._mean, self._sigma, self._seed = self.run.mean, self.run.sigma, seed
        self._tol_loss, self._tol_sigma, self._generations = tol_loss, tol_sigma, generations
        self._best_x, self._best_loss = self.run.mean, math.inf
        self.restarts, self._ended = 0, 0

    def ask(self) -> Array:
        """Draw one generation: (P, n); P is `run.population` and grows with every restart."""
        return self.run.ask()

    def tell(self, samples: Array, losses: Array) -> None:
        """Learn from one generation as `CMAES.tell`, and start anew if the run has come to rest."""
        self.run.tell(samples, losses)
        if self.run.best_loss < self._best_loss:
            self._best_x, self._best_loss = self.run.best_x, self.run.best_loss
        if any(
            self.run.converged(*tolerances, self._generations)
            for tolerances in ((self._tol_loss, math.inf), (math.inf, self._tol_sigma))
        ):
            self._restart()

    def _restart(self) -> None:
        state = self.run.state()
        self.restarts += 1
        self._ended += self.run.evaluations
        rng = np.random.default_rng([self._seed, self.restarts])
        scales, bounds = np.asarray(state["scales"]), np.asarray(state["bounds"])
        mean = self._mean + self._sigma * scales * rng.standard_normal(self._mean.size)  # (n,)
        self.run = CMAES(
            np.clip(mean, *bounds.T) if bounds.size else mean,
            self._sigma,
            scales=scales,
            population=_GROWTH * self.run.population,
            covariance=state["covariance"],  # type: ignore[arg-type]
            bounds=bounds if bounds.size else None,
            rng=rng,
        )

    @property
    def best_x(self) -> Array:
        """(n,) best sample told so far to any run; the first mean before one with a finite loss was told."""
        return self._best_x.copy()

    @property
    def best_loss(self) -> float:
        """Loss of `best_x`, inf before a finite one was told."""
        return self._best_loss

    @property
    def evaluations(self) -> int:
        """Losses told to all runs."""
        return self._ended + self.run.evaluations

    def state(self) -> State:
        """All that it needs to go on with the same bits: `CMAES.state` of the run, and some more."""
        return {
            **self.run.state(),
            "first_mean": self._mean.copy(),
            "first_sigma": self._sigma,
            "seed": self._seed,
            "restarts": self.restarts,
            "ended": self._ended,
            "tolerances": np.array([self._tol_loss, self._tol_sigma]),
            "generations": self._generations or 0,
            "overall_x": self._best_x.copy(),
            "overall_loss": self._best_loss,
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Restarts:
        """The runs of `state`; the values may have gone through `.npz` or JSON.

        Raises:
            ValueError: as `CMAES.from_state`.
        """
        tol_loss, tol_sigma = (float(tolerance) for tolerance in state["tolerances"])
        self = cls(
            np.array(state["first_mean"], dtype=np.float64),
            float(state["first_sigma"]),
            tol_loss=tol_loss,
            tol_sigma=tol_sigma,
            generations=int(state["generations"]) or None,
            seed=int(state["seed"]),
        )
        self.run = CMAES.from_state(state)
        self.restarts, self._ended = int(state["restarts"]), int(state["ended"])
        self._best_x = np.array(state["overall_x"], dtype=np.float64)
        self._best_loss = float(state["overall_loss"])
        return self
