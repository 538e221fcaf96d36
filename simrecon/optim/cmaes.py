"""CMA-ES with ask and tell; it knows nothing of what it minimises.

Source: N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv 1604.00772, whose equation numbers stand
at the lines that implement them; for the constants see `strategy`, for diagonal and low-rank variants
`covariance`. Axes: P samples of a generation, n variables.
"""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

from simrecon.optim import covariance as shapes
from simrecon.optim.covariance import SMALLEST, Covariance
from simrecon.optim.strategy import strategy
from simrecon.types import Array

_LARGEST = 1e200  # keeps the step size finite when a run diverges


class CMAES:
    """Minimise f: Rⁿ → R: sample x ~ N(m, σ² C), and learn m, σ, C from ranks.

    Args:
        mean: (n,) start.
        sigma: initial step size, the same in all variables.
        population: samples of a generation, 4 + ⌊3 ln n⌋ if None (eq. 48).
        covariance: `diagonal` or `low_rank` (linear cost), or `full`.
        rng: generator to draw from, or a seed.

    Raises:
        ValueError: a shape or a value that can't be used.
    """

    def __init__(
        self,
        mean: Array,
        sigma: float,
        *,
        population: int | None = None,
        covariance: Covariance = "diagonal",
        rng: np.random.Generator | int,
    ) -> None:
        self._mean = np.array(mean, dtype=np.float64)
        if self._mean.ndim != 1 or self._mean.size == 0 or not np.isfinite(self._mean).all():
            raise ValueError(f"mean: shape {self._mean.shape}; valid is a finite (n,) array with n >= 1")
        n = self._mean.size
        self._sigma = float(sigma)
        if not (self._sigma > 0 and math.isfinite(self._sigma)):
            raise ValueError(f"sigma: {sigma}; valid is a positive finite number")
        self._population = 4 + int(3 * math.log(n)) if population is None else int(population)  # eq. 48
        if self._population < 2:
            raise ValueError(f"population: {population}; valid is 2 or more")
        if covariance not in get_args(Covariance):
            raise ValueError(f"covariance: {covariance!r}; valid are {', '.join(get_args(Covariance))}")
        self._rng = np.random.default_rng(rng)
        self._constants = strategy(n, self._population, covariance)
        self._shape = shapes.identity(covariance, n, self._constants.c_1 + self._constants.c_mu)
        self._path_sigma, self._path_c = np.zeros(n), np.zeros(n)
        self._generation = 0

    def ask(self) -> Array:
        """Draw one generation: (P, n)."""
        normal = self._rng.standard_normal((self._population, self._mean.size))  # (P, n) eq. 38
        samples = self._shape.colour(normal)  # (P, n) eq. 39
        samples *= self._sigma
        samples += self._mean  # (P, n) eq. 40
        return samples

    def tell(self, samples: Array, losses: Array) -> None:
        """Learn from one generation; the arguments are left as they are.

        Only the order of the losses counts. Infinite and NaN losses rank last; if no loss is finite there is
        nothing to learn from and the distribution stays as it is.

        Args:
            samples: (P, n) of the last `ask`, in any order.
            losses: (P,) of those samples.

        Raises:
            ValueError: a wrong shape, or samples that are not finite.
        """
        samples, losses = self._checked(samples, losses)
        order = np.argsort(losses, kind="stable")  # (P,)
        self._generation += 1
        if losses[order[0]] == math.inf:
            return
        steps = samples[order]  # (P, n) a copy
        steps -= self._mean
        steps /= self._sigma  # (P, n)
        self._learn(steps)

    def _learn(self, steps: Array) -> None:
        """Eq. 41 to 47 on ranked steps (P, n), best first."""
        k = self._constants
        n = steps.shape[1]
        mean_step = k.weights[: k.mu] @ steps[: k.mu]  # (n,) eq. 41
        drift = math.sqrt(k.c_sigma * (2 - k.c_sigma) * k.mu_eff) * self._shape.whiten(mean_step)  # (n,)
        self._path_sigma = (1 - k.c_sigma) * self._path_sigma + drift  # (n,) eq. 43
        length = float(np.linalg.norm(self._path_sigma))
        settled = math.sqrt(1 - (1 - k.c_sigma) ** (2 * self._generation))
        h_sigma = float(length / settled < (1.4 + 2 / (n + 1)) * k.chi_n)  # below eq. 45
        drift = h_sigma * math.sqrt(k.c_c * (2 - k.c_c) * k.mu_eff) * mean_step  # (n,)
        self._path_c = (1 - k.c_c) * self._path_c + drift  # (n,) eq. 45
        weights = k.c_mu * k.weights  # (P,)
        last = slice(int(np.count_nonzero(weights >= 0)), None)
        weights[last] *= n / np.maximum(self._shape.distance2(steps[last]), 1e-30)  # eq. 46
        keep = 1 + k.c_1 * (1 - h_sigma) * k.c_c * (2 - k.c_c) - k.c_1 - k.c_mu * k.weights.sum()  # eq. 47
        self._shape.update(float(keep), k.c_1, self._path_c, weights, steps)  # eq. 47
        self._mean = self._mean + self._sigma * mean_step  # (n,) eq. 42
        # A factor above e in one generation comes only from samples that were not drawn here.
        growth = math.exp(min(1.0, k.c_sigma / k.d_sigma * (length / k.chi_n - 1)))  # eq. 44
        self._sigma = min(max(self._sigma * growth, SMALLEST), _LARGEST)

    def _checked(self, samples: Array, losses: Array) -> tuple[Array, Array]:
        samples, losses = np.asarray(samples, dtype=np.float64), np.asarray(losses, dtype=np.float64)
        shape = (self._population, self._mean.size)
        if samples.shape != shape:
            raise ValueError(f"samples: shape {samples.shape}; valid is {shape}")
        if losses.shape != shape[:1]:
            raise ValueError(f"losses: shape {losses.shape}; valid is {shape[:1]}")
        if not np.isfinite(samples).all():
            raise ValueError("samples: NaN or inf; valid are finite numbers")
        return samples, np.where(np.isnan(losses), np.inf, losses)

    @property
    def mean(self) -> Array:
        """(n,) centre of the distribution."""
        return self._mean.copy()

    @property
    def sigma(self) -> float:
        """Overall step size."""
        return self._sigma

    @property
    def population(self) -> int:
        """Samples of a generation."""
        return self._population

    @property
    def evaluations(self) -> int:
        """Losses that `tell` has received."""
        return self._generation * self._population
