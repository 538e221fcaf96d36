"""What a term of the loss of a rollout is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Self

from simrecon.engines.problem import Problem
from simrecon.engines.sampling.terms.moves import Moves
from simrecon.engines.sampling.terms.seen import Seen
from simrecon.optim import gauss_newton
from simrecon.types import Array


@dataclass(frozen=True, eq=False)
class LossTerm(ABC):
    """One term of the loss Σ_k w_k f_k of a rollout; pure, batched over P rollouts.

    Attributes:
        name: of the term, and of its weight in `[loss]` of a plan.
        differences: frames before its own that a frame of the term looks at.
        needs_camera: whether it is left out without a camera.
        weight: w.
    """

    name: ClassVar[str]
    differences: ClassVar[int] = 0
    needs_camera: ClassVar[bool] = False

    weight: float

    @classmethod
    def of(cls, weight: float, problem: Problem, frames: int) -> Self:  # noqa: ARG003
        """The term in a window of a clip that has so many frames of the loss."""
        return cls(weight)

    @classmethod
    def applies(cls, problem: Problem) -> bool:
        """Whether the clip has what the term looks at."""
        return problem.world_to_camera is not None or not cls.needs_camera

    @abstractmethod
    def value(self, seen: Seen) -> Array:
        """f, summed over the frames, without the weight: (P,)."""

    @abstractmethod
    def residual(self, seen: Seen) -> gauss_newton.Term:
        """Vectors by frame whose lengths w f penalises, for Gauss-Newton steps; (P, F', ..., d).

        They are the `differences`-th differences, frame by frame, of what depends on one frame only.
        """

    @abstractmethod
    def slope(self, seen: Seen, moves: Moves) -> Array:
        """Derivative (F, ..., d, V) of what the vectors are differences of, at the first rollout."""
