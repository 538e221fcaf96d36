"""Windows of a clip, before and after they are solved."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from simrecon.types.arrays import Array, IntArray


@dataclass(frozen=True)
class Window:
    """One piece of the clip, in simulation steps: optimised over [start, end), kept over [start, commit)."""

    index: int
    start_step: int
    commit_step: int
    end_step: int


@dataclass(frozen=True, eq=False)
class Handover:
    """What one window passes to the next: full integration state with solver warm start, and spline knots.

    Attributes:
        state: (nstate,) `mjSTATE_INTEGRATION`.
        knots_rad: (Q, nu) control offsets of the window's knots; none before the first window.
        first: index of the first of them among the knots of the clip.
    """

    state: Array
    knots_rad: Array
    first: int = 0


class WindowStatus(Enum):
    """The rule that ended the optimisation of a window."""

    DESCENT = "all descent steps used"
    GENERATIONS = "all generations used"
    AT_REST = "the loss improved by less than tol_loss and tol_loss_absolute"
    SMALL_STEPS = "the step size fell below tol_sigma"
    FAILED = "no rollout stayed finite"


@dataclass(frozen=True)
class Effort:
    """What a window is solved with after a fall, or after a doubt.

    Attributes:
        retry: 0 at first; each one doubles generations and descent steps and draws other random numbers.
        until: index of the last window that is solved so, the one that fell, or whose loss was in doubt.
        again: how often it was solved again because of a doubt, which draws other random numbers only.
    """

    retry: int = 0
    until: int = -1
    again: int = 0

    @property
    def draw(self) -> tuple[int, ...]:
        """Of its random numbers, beside the seed and the window."""
        return (self.retry, self.again) if self.again else (self.retry,)

    @property
    def factor(self) -> int:
        """On the numbers of generations and descent steps."""
        return int(2**self.retry)


@dataclass(frozen=True, eq=False)
class Spread:
    """How else the scene might push, over rollouts about the end of a search, weighted by their loss.

    Attributes:
        force_N: (F, 3, 3) standard deviation of the force on left foot, right foot and whole person, at the
            frames after the window's first one up to the last that is kept; means since the frame before.
        touch: (F, C) share of the rollouts in which each geom of the person is pushed.
    """

    force_N: Array
    touch: Array


@dataclass(frozen=True, eq=False)
class WindowResult:
    """One solved window.

    Attributes:
        window: which.
        ctrl: (commit_step - start_step, nu) the committed control.
        states: (commit_step - start_step + 1, nstate) the committed states, the first included.
        loss: best total loss; loss_terms: its weighted terms by name.
        trace: (1 + D + G,) best loss at the warm start, after each descent step and each generation.
        steps: (1 + D + G,) simulation steps spent until then.
        descent_steps: D. evaluations: rollouts done, the last one of the mean.
        seconds: wall time. stepping_s: within MuJoCo, of all threads over their number.
        handover: to the next window.
        gap_from: index of the first of the windows before it that could not be simulated, so that it begins
            at the kinematic fit; -1: there are none.
        spread: of forces and contacts; None: the plan asks for none, or nothing stayed finite.
    """

    window: Window
    ctrl: Array
    states: Array
    loss: float
    loss_terms: dict[str, float]
    trace: Array
    steps: IntArray
    descent_steps: int
    evaluations: int
    seconds: float
    stepping_s: float
    status: WindowStatus
    effort: Effort
    handover: Handover
    gap_from: int = -1
    spread: Spread | None = None

    @property
    def begins_anew(self) -> bool:
        """Whether it begins at the kinematic fit, after a gap."""
        return self.gap_from >= 0
