"""How the search of one window goes, and when it has come to rest."""

from __future__ import annotations

from dataclasses import dataclass, field

from simrecon.plan import Optimiser


@dataclass
class Course:
    """How the best loss of a window went: at the start and after each step.

    Attributes:
        losses: best so far. steps: simulation steps spent until then.
        evaluations: rollouts in all.
    """

    losses: list[float] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    evaluations: int = 0

    def add(self, loss: float, steps: int) -> None:
        """One more entry."""
        self.losses.append(min([loss, *self.losses[-1:]]))
        self.steps.append(steps)

    def at_rest(self, optimiser: Optimiser, patience: int, since: int = 0) -> bool:
        """Whether `patience` entries after number `since` lowered the loss by what the plan ignores."""
        if len(self.losses) - 1 - since < patience:
            return False
        gained = self.losses[-1 - patience] - self.losses[-1]
        least = optimiser.tol_loss * self.losses[-1] + optimiser.tol_loss_absolute
        return least > 0.0 and gained <= least
