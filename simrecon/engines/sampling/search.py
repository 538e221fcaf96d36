"""CMA-ES around the end of a descent: every sample is a whole rollout."""

from __future__ import annotations

import numpy as np

from simrecon.engines.sampling.course import Course
from simrecon.engines.sampling.descent import Descent
from simrecon.optim.cmaes import CMAES
from simrecon.types import Array, WindowStatus

# Generations over which the best loss is looked at, to tell whether it is at rest.
PATIENCE = 10


class Search:
    """CMA-ES in coordinates in which the loss is round at the end of a descent.

    Unknowns are x = x0 + R z with the symmetric root R of a covariance that comes from the curvature of the
    loss (`Quadratic.root_covariance`), so that sigma = 1 and a diagonal covariance of z begin well. Without a
    descent R holds the plan's deviations.

    Attributes:
        x: (n,) best so far; loss: there; terms: of it, weighted, by name.
        es: asks for samples z and learns from them.
    """

    def __init__(self, descent: Descent, rng: np.random.Generator) -> None:
        """Begin where the descent is."""
        task, plan = descent.task, descent.task.problem.plan.optimiser
        self.task, self.simulator = task, descent.simulator
        self.x, self.loss, self.terms = descent.x, descent.loss, descent.terms
        self._optimiser = plan
        self._origin, self._scale, self._root = descent.x, task.deviations(), None
        if descent.quadratic is not None:
            self._root = descent.quadratic.root_covariance(plan.spread * descent.loss, 1.0)
        self._low, self._high = task.bounds().T
        self.es = CMAES(
            np.zeros(len(descent.x)), 1.0, population=plan.population, covariance=plan.covariance, rng=rng
        )

    def generation(self) -> None:
        """Sample, simulate, learn."""
        samples = self.es.ask()
        self.es.tell(samples, self.consider(samples))

    def unknowns(self, samples: Array) -> Array:
        """Unknowns x (P, n), within their bounds, of samples z (P, n)."""
        moves = samples if self._root is None else samples @ self._root
        return np.clip(self._origin + moves * self._scale, self._low, self._high)

    def consider(self, samples: Array) -> Array:
        """Losses (P,) of samples z (P, n); the best one is kept if nothing before was better."""
        x = self.unknowns(samples)
        values, finite = self.task.evaluate(self.simulator, x)
        total: Array = np.where(finite, sum(values.values()), np.inf)
        lowest = int(np.argmin(total))
        if total[lowest] < self.loss:
            self.loss, self.x = float(total[lowest]), x[lowest].copy()
            self.terms = {name: float(value[lowest]) for name, value in values.items()}
        return total

    def ended(self, course: Course, since: int) -> WindowStatus | None:
        """The rule that ends the window now: sigma, or the best loss since an entry of its course."""
        if self.es.sigma <= self._optimiser.tol_sigma:
            return WindowStatus.SMALL_STEPS
        return WindowStatus.AT_REST if course.at_rest(self._optimiser, PATIENCE, since) else None
