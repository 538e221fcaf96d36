"""CMA-ES with ask and tell; it knows nothing of what it minimises.

Source: N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv 1604.00772, whose equation numbers are
given below; for the diagonal variant R. Ros and N. Hansen, "A Simple Modification in CMA-ES Achieving Linear
Time and Space Complexity", PPSN 2008; for the low-rank one see `covariance`. Axes: P samples of a generation,
n variables.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from simrecon.optim import covariance as shapes
from simrecon.optim.covariance import SMALLEST, Covariance, State
from simrecon.types import Array

__all__ = ["CMAES", "Covariance", "State", "Strategy", "strategy"]

_SCHEMA = "simrecon.cmaes/1"
_BIT_GENERATORS = ("PCG64", "PCG64DXSM", "Philox", "SFC64", "MT19937")
_LARGEST = 1e200  # keeps the step size of a run finite that ran away


@dataclass(frozen=True, eq=False)
class Strategy:
    """Constants of the strategy, tutorial table 1.

    Attributes:
        weights: (P,) by rank, best first; the negative ones make the covariance update active.
        mu: number of samples that move the mean.
        mu_eff: variance-effective selection mass of those.
        c_sigma, d_sigma: learning rate and damping of the step size.
        c_c, c_1, c_mu: learning rates of the path, the rank-one and the rank-mu update.
        chi_n: expected length of an n-variate standard normal vector.
    """

    weights: Array
    mu: int
    mu_eff: float
    c_sigma: float
    d_sigma: float
    c_c: float
    c_1: float
    c_mu: float
    chi_n: float


def strategy(n: int, population: int, covariance: Covariance) -> Strategy:
    """Default constants, tutorial eq. 49 to 58.

    Diagonal rates are those of Ros and Hansen 2008. Those of low rank fall with its n (k + 2) numbers, as in
    Y. Akimoto and N. Hansen, "Online Model Selection for Restricted Covariance Matrix Adaptation",
    PPSN 2016, with the 1/4 of eq. 58, without which two samples teach nothing.

    Args:
        n: number of variables.
        population: samples of a generation.
        covariance: `diagonal` learns c_1 and c_mu (n + 2) / 3 times as fast as `full`.
    """
    raw = math.log((population + 1) / 2) - np.log(np.arange(1, population + 1))  # (P,) eq. 49
    mu = population // 2
    mu_eff = float(raw[:mu].sum() ** 2 / (raw[:mu] ** 2).sum())  # table 1
    mu_eff_negative = float(raw[mu:].sum() ** 2 / (raw[mu:] ** 2).sum())  # table 1
    faster = (n + 2) / 3 if covariance == "diagonal" else 1.0
    c_1 = faster * 2 / ((n + 1.3) ** 2 + mu_eff)  # eq. 57
    c_mu = min(1 - c_1, faster * 2 * (0.25 + mu_eff + 1 / mu_eff - 2) / ((n + 2) ** 2 + mu_eff))  # eq. 58
    c_c = (4 + mu_eff / n) / (n + 4 + 2 * mu_eff / n)  # eq. 56
    if covariance == "low_rank":
        size = (n + 2) * (shapes.rank(n) + 2)
        c_1 = 2 / (size + mu_eff)
        size += 2 * (shapes.rank(n) + 2)
        c_mu = min(1 - c_1, 2 * (0.25 + mu_eff + 1 / mu_eff - 2) / (size + mu_eff))
        c_c = math.sqrt(c_1)
    alpha = min(1 + c_1 / c_mu, 1 + 2 * mu_eff_negative / (mu_eff + 2))  # eq. 50, 51
    if covariance == "full":
        alpha = min(alpha, (1 - c_1 - c_mu) / (n * c_mu))  # eq. 52
    positive, negative = raw[raw > 0].sum(), -raw[raw < 0].sum()
    c_sigma = (mu_eff + 2) / (n + mu_eff + 5)  # eq. 55
    return Strategy(
        weights=np.where(raw >= 0, raw / positive, raw * (alpha / negative)),  # (P,) eq. 53
        mu=mu,
        mu_eff=mu_eff,
        c_sigma=c_sigma,
        d_sigma=1 + 2 * max(0.0, math.sqrt((mu_eff - 1) / (n + 1)) - 1) + c_sigma,  # eq. 55
        c_c=c_c,
        c_1=c_1,
        c_mu=c_mu,
        chi_n=math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n)),  # below eq. 44
    )


class CMAES:
    """Minimise f: Rⁿ → R: sample x ~ N(m, σ² S C S), S = diag(scales), and learn m, σ, C from ranks.

    Bounds: the search runs without bounds on f(fold(u)), where fold mirrors u at the limits (again and again,
    if there are two) until it lies between them. What is drawn is thus what is learnt from, no penalty is
    needed, and f(fold(u)) is continuous if f is. Scales are cut so that no deviation starts above a quarter
    of its range. Without bounds nothing of this runs.

    Args:
        mean: (n,) start.
        sigma: overall initial step size.
        scales: (n,) initial standard deviations in units of sigma; ones if None.
        population: samples of a generation, 4 + ⌊3 ln n⌋ if None (eq. 48).
        covariance: `diagonal` or `low_rank` (linear cost), or `full`.
        bounds: (n, 2) lower and upper limits, ±inf = none; or None.
        rng: generator to draw from, or a seed.

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
        rng: np.random.Generator | int,
    ) -> None:
        self._mean = _array(mean)
        if self._mean.ndim != 1 or self._mean.size == 0 or not np.isfinite(self._mean).all():
            raise ValueError(f"mean: shape {self._mean.shape}; valid is a finite (n,) array with n >= 1")
        n = self._mean.size
        self._sigma = float(sigma)
        if not (self._sigma > 0 and math.isfinite(self._sigma)):
            raise ValueError(f"sigma: {sigma}; valid is a positive finite number")
        self._scales = np.ones(n) if scales is None else _array(scales)
        if self._scales.shape != (n,) or not (np.isfinite(self._scales) & (self._scales > 0)).all():
            raise ValueError(f"scales: shape {self._scales.shape}; valid is ({n},), positive and finite")
        self._population = 4 + int(3 * math.log(n)) if population is None else int(population)  # eq. 48
        if self._population < 2:
            raise ValueError(f"population: {population}; valid is 2 or more")
        if covariance not in get_args(Covariance):
            raise ValueError(f"covariance: {covariance!r}; valid are {', '.join(get_args(Covariance))}")
        self._covariance: Covariance = covariance
        self._bounds = None if bounds is None else _checked_bounds(bounds, self._mean)
        if self._bounds is not None:
            self._scales = np.minimum(self._scales, np.diff(self._bounds)[:, 0] / (4 * self._sigma))  # (n,)
        self._rng = np.random.default_rng(rng)
        self._constants = strategy(n, self._population, covariance)
        self._shape = shapes.identity(covariance, n, self._constants.c_1 + self._constants.c_mu)
        self._path_sigma, self._path_c = np.zeros(n), np.zeros(n)
        self._unfolded = np.empty((0, n))
        self._best_x, self._best_loss = self._mean.copy(), math.inf
        self._history: list[float] = []

    def ask(self) -> Array:
        """Draw one generation: (P, n), within the bounds."""
        normal = self._rng.standard_normal((self._population, self._mean.size))  # (P, n) eq. 38
        samples = self._shape.colour(normal)  # (P, n) eq. 39
        samples *= self._sigma * self._scales
        samples += self._mean  # (P, n) eq. 40
        if self._bounds is None:
            return samples
        self._unfolded = samples
        return _folded(samples, self._bounds)

    def tell(self, samples: Array, losses: Array) -> None:
        """Learn from one generation; the arguments are left as they are.

        Only the order of the losses counts. Infinite and NaN losses rank last; if no loss is finite there is
        nothing to learn from and the distribution stays as it is.

        Args:
            samples: (P, n) as the last `ask` gave them, in any order.
            losses: (P,) of those samples.

        Raises:
            ValueError: a wrong shape, or samples that are not finite.
        """
        samples, losses = self._checked(samples, losses)
        order = np.argsort(losses, kind="stable")  # (P,)
        best = int(order[0])
        self._history.append(float(losses[best]))
        if losses[best] == math.inf:
            return
        if losses[best] < self._best_loss:
            self._best_loss = float(losses[best])
            self._best_x = samples[best].copy()
        steps = self._as_drawn(samples[order])  # (P, n) a copy
        steps -= self._mean
        steps /= self._sigma * self._scales  # (P, n)
        self._learn(steps)

    def _as_drawn(self, samples: Array) -> Array:
        """(P, n) what `ask` folded into `samples`; a sample that it did not give stands for itself."""
        if self._bounds is None or not self._unfolded.size:
            return samples
        folded = _folded(self._unfolded, self._bounds)  # (P, n)
        rows = (samples[:, :1] == folded[:, 0]).argmax(axis=1)  # (P,) of two equal first coordinates any
        known = (samples == folded[rows]).all(axis=1, keepdims=True)  # (P, 1)
        return np.where(known, self._unfolded[rows], samples)

    def _learn(self, steps: Array) -> None:
        """Eq. 41 to 47 on ranked steps (P, n), best first."""
        k = self._constants
        n = steps.shape[1]
        mean_step = k.weights[: k.mu] @ steps[: k.mu]  # (n,) eq. 41
        drift = math.sqrt(k.c_sigma * (2 - k.c_sigma) * k.mu_eff) * self._shape.whiten(mean_step)  # (n,)
        self._path_sigma = (1 - k.c_sigma) * self._path_sigma + drift  # (n,) eq. 43
        length = float(np.linalg.norm(self._path_sigma))
        settled = math.sqrt(1 - (1 - k.c_sigma) ** (2 * self.generation))
        h_sigma = float(length / settled < (1.4 + 2 / (n + 1)) * k.chi_n)  # below eq. 45
        drift = h_sigma * math.sqrt(k.c_c * (2 - k.c_c) * k.mu_eff) * mean_step  # (n,)
        self._path_c = (1 - k.c_c) * self._path_c + drift  # (n,) eq. 45
        weights = k.c_mu * k.weights  # (P,)
        last = slice(int(np.count_nonzero(weights >= 0)), None)
        weights[last] *= n / np.maximum(self._shape.distance2(steps[last]), 1e-30)  # eq. 46
        keep = 1 + k.c_1 * (1 - h_sigma) * k.c_c * (2 - k.c_c) - k.c_1 - k.c_mu * k.weights.sum()  # eq. 47
        self._shape.update(float(keep), k.c_1, self._path_c, weights, steps)  # eq. 47
        self._mean = self._mean + self._sigma * self._scales * mean_step  # (n,) eq. 42
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

    def converged(self, tol_loss: float, tol_sigma: float, generations: int | None = None) -> bool:
        """Whether both loss and step size have come to rest; changes nothing.

        Args:
            tol_loss: limit on the range of the best losses of recent generations (tutorial B.3, TolFun).
            tol_sigma: limit on the largest standard deviation in units of `scales` (tutorial B.3, TolX).
            generations: how many are recent; 10 + ⌈30 n / P⌉ if None (tutorial B.3).
        """
        count = generations or 10 + math.ceil(30 * self._mean.size / self._population)
        if len(self._history) < count or not np.isfinite(self._history[-count:]).all():
            return False
        at_rest = float(np.ptp(self._history[-count:])) <= tol_loss
        return at_rest and float((self._sigma * self._shape.deviations).max()) <= tol_sigma

    @property
    def mean(self) -> Array:
        """(n,) centre of the distribution, within the bounds."""
        return self._mean.copy() if self._bounds is None else _folded(self._mean, self._bounds)

    @property
    def sigma(self) -> float:
        """Overall step size."""
        return self._sigma

    @property
    def standard_deviations(self) -> Array:
        """(n,) of the samples (before they are folded into the bounds), in the units of x."""
        return self._sigma * self._scales * self._shape.deviations

    @property
    def best_x(self) -> Array:
        """(n,) best sample told so far; the initial mean before one with a finite loss was told."""
        return self._best_x.copy()

    @property
    def best_loss(self) -> float:
        """Loss of `best_x`, inf before a finite one was told."""
        return self._best_loss

    @property
    def history(self) -> Array:
        """(G,) best loss of each generation, inf where none was finite."""
        return np.array(self._history)

    @property
    def population(self) -> int:
        """Samples of a generation."""
        return self._population

    @property
    def generation(self) -> int:
        """Generations told."""
        return len(self._history)

    @property
    def evaluations(self) -> int:
        """Losses told."""
        return len(self._history) * self._population

    def state(self) -> State:
        """All that a run needs to go on with the same bits: plain arrays, numbers and strings."""
        generator = self._rng.bit_generator.state
        return {
            "schema": _SCHEMA,
            "covariance": self._covariance,
            "population": self._population,
            "mean": self._mean.copy(),
            "sigma": self._sigma,
            "scales": self._scales.copy(),
            "bounds": np.empty((0, 2)) if self._bounds is None else self._bounds.copy(),
            "path_sigma": self._path_sigma.copy(),
            "path_c": self._path_c.copy(),
            "unfolded": self._unfolded.copy(),
            "best_x": self._best_x.copy(),
            "best_loss": self._best_loss,
            "history": self.history,
            "rng": json.dumps(generator, default=lambda array: array.tolist()),
            **self._shape.state(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> CMAES:
        """The run of `state`, with a generator of its own; the values may have gone through `.npz` or JSON.

        Raises:
            ValueError: another schema or bit generator.
        """
        if "schema" not in state or str(state["schema"]) != _SCHEMA:
            raise ValueError(f"schema: {state.get('schema')}; valid is {_SCHEMA!r}")
        bounds = _array(state["bounds"]).reshape(-1, 2)
        covariance: Any = str(state["covariance"])
        run = cls(
            _array(state["best_x"]),
            float(state["sigma"]),
            population=int(state["population"]),
            covariance=covariance,
            bounds=bounds if bounds.size else None,
            rng=_generator(str(state["rng"])),
        )
        run._mean, run._scales = _array(state["mean"]), _array(state["scales"])
        run._path_sigma, run._path_c = _array(state["path_sigma"]), _array(state["path_c"])
        run._unfolded = _array(state["unfolded"]).reshape(-1, run._mean.size)
        run._best_loss = float(state["best_loss"])
        run._history = _array(state["history"]).tolist()
        run._shape = shapes.restored(covariance, state, run._constants.c_1 + run._constants.c_mu)
        return run


def _array(value: Any) -> Array:
    return np.array(value, dtype=np.float64)


def _generator(text: str) -> np.random.Generator:
    """The generator whose state `text` holds as JSON."""
    state = json.loads(text)
    name = state["bit_generator"]
    if name not in _BIT_GENERATORS:
        raise ValueError(f"rng: bit generator {name!r}; valid are {', '.join(_BIT_GENERATORS)}")
    bit_generator = getattr(np.random, name)()
    bit_generator.state = state
    return np.random.Generator(bit_generator)


def _folded(points: Array, bounds: Array) -> Array:
    """(…, n) `points` mirrored at the limits until they lie between them; those that do stay as they are."""
    lower, upper = bounds.T  # (n,), (n,)
    both = np.isfinite(lower) & np.isfinite(upper)  # (n,)
    low, width = np.where(both, lower, 0.0), np.where(both, upper - lower, 1.0)  # (n,), (n,)
    twice = low + width - np.abs(np.mod(points - low, 2 * width) - width)  # (…, n)
    once = np.minimum(np.maximum(points, 2 * lower - points), 2 * upper - points)  # (…, n)
    inside = (lower <= points) & (points <= upper)  # (…, n)
    return np.where(inside, points, np.clip(np.where(both, twice, once), lower, upper))  # (…, n)


def _checked_bounds(bounds: Array, mean: Array) -> Array:
    """(n, 2) copy of the bounds."""
    bounds = _array(bounds)
    if bounds.shape != (mean.size, 2):
        raise ValueError(f"bounds: shape {bounds.shape}; valid is ({mean.size}, 2)")
    if not (bounds[:, 0] < bounds[:, 1]).all():
        raise ValueError("bounds: lower limit not below the upper one; valid is lower < upper in each row")
    if not ((bounds[:, 0] <= mean) & (mean <= bounds[:, 1])).all():
        raise ValueError("mean: outside the bounds; valid is lower <= mean <= upper")
    return bounds
