"""What a term of the kinematic objective is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.plan import Kinematics


class Term(ABC):
    """One term: its weight, its loss and gradient, its curvature.

    A term is of one frame, or of up to three in a row, or a prior on what all frames share.

    Attributes:
        name: in reports, and of the weight in the plan.
        needs_floor: it acts only where the floor is known (G of Gärtner 2022, table 2).
        temporal: it ties frames to each other (T of the same table).
        planned: its weight is in the plan; else it is one.
        per_frame: it is a sum over frames, times their interval; else it is of the whole clip.
        listed: a report names it at a weight of zero, too.
    """

    name: ClassVar[str]
    needs_floor: ClassVar[bool] = False
    temporal: ClassVar[bool] = False
    planned: ClassVar[bool] = True
    per_frame: ClassVar[bool] = True
    listed: ClassVar[bool] = False

    def weight(self, plan: Kinematics) -> float:
        """The weight, zero where the term is switched off."""
        return float(getattr(plan, self.name)) if self.planned else 1.0

    def unit(self, problem: Problem) -> float:
        """What the loss is multiplied by."""
        weight = self.weight(problem.plan)
        return weight * problem.dt if self.per_frame else weight

    def applies(self, problem: Problem) -> bool:  # noqa: ARG002
        """Whether the evidence has what it needs."""
        return True

    @abstractmethod
    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """The loss times `unit`; its derivatives are added to `gradient`."""

    @abstractmethod
    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Add its part of the Hessian in the approximation of Gauss and Newton."""
