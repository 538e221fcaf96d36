"""Terms of contacts that a user wishes: a part touches, stays where it is, or does not touch.

They have no weight in the plan, and none where nothing is wished. A wish far from what the evidence shows
fades, so that it leaves the rest of the motion alone; `contact.honoured` says so.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simrecon.contact.parts import HEELS, TOES
from simrecon.kinematics import bands
from simrecon.kinematics.contacts import Places, lowest
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kernels import held
from simrecon.kinematics.terms.term import Term
from simrecon.kinematics.terms.touch import touching
from simrecon.types import Array, Flags, IntArray

# A part that is to touch is held within about a centimetre; the pull fades with the distance.
SIGMA_WISH_M, FADES_M = 0.005, 0.15
SIGMA_STAYS_MPS = 0.03
DEPTH_M = 0.003
"""At which a part rests that is to touch: what hovers by a millimetre is not pushed."""
APART_M = 0.04
"""From what a part is that is not to touch: more than what counts as near, and than a fit is off."""


class _Wish(Term):
    """A term that acts where something is wished, with a weight of one."""

    planned = False
    needs_floor = True

    def applies(self, problem: Problem) -> bool:
        """Whether anything is wished."""
        return problem.observations.targets is not None


class Touches(_Wish):
    """A part touches what is nearest to it."""

    name = "wished_touch"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Distance of its lowest point, whose pull fades beyond `FADES_M`."""
        total, weight = 0.0, (FADES_M / SIGMA_WISH_M) ** 2
        for at, depth in _touching(state):
            loss, slope = touching(state.clearance_m[at] + depth, FADES_M, weight)
            gradient.clearances[at] += unit * slope
            total += unit * loss
        return total

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Of the pulls that have not faded."""
        for at, depth in _touching(state):
            far = (state.clearance_m[at] + depth) / FADES_M
            hessian.nearest[at[1:]] += weight / SIGMA_WISH_M**2 / (1 + far**2) ** 2


class Stays(_Wish):
    """A part that touches and stays is at rest from a frame to the next (Rempe 2020, eq. B6)."""

    name = "wished_stay"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared speed of its points."""
        total = 0.0
        for _, rows, steps in _staying(state.problem):
            weights = np.broadcast_to(steps / len(rows), (len(rows), len(steps)))
            loss, slope = held(state.spheres_m[rows], weights, state.dt, SIGMA_STAYS_MPS)
            gradient.spheres[rows] += unit * slope
            total += unit * loss
        return total

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Of feet alone, as if heels and toes were held."""
        own = [steps for name, _, steps in _staying(state.problem) if name in (*HEELS, *TOES)]
        if own:
            unit = 2 * weight / (state.dt * SIGMA_STAYS_MPS**2) / len(state.problem.feet)
            hessian.feet.append(bands.first_differences(unit * np.sum(own, axis=0)))


class Free(_Wish):
    """A part that is not to touch is `APART_M` or more from everything."""

    name = "wished_free"

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared distance that its lowest point lacks."""
        total = 0.0
        for at in _free(state):
            lack = np.maximum(APART_M - state.clearance_m[at], 0.0) / SIGMA_WISH_M
            gradient.clearances[at] -= unit * 2 * lack / SIGMA_WISH_M
            total += unit * float(np.sum(lack**2))
        return total

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Of what is too near."""
        for at in _free(state):
            lacks = state.clearance_m[at] < APART_M
            hessian.nearest[at[1:]] += np.where(lacks, weight / SIGMA_WISH_M**2, 0.0)


def _touching(state: State) -> Iterator[tuple[Places, float]]:
    """Places of the clearances by which parts are to touch, in the frames in which they are, and how deep."""
    targets = state.problem.observations.targets
    if targets is not None:
        for column in np.flatnonzero(targets.touch.any(axis=0)):
            at = lowest(state.problem.contacts.parts[column], state.clearance_m)
            yield _in(at, targets.touch[:, column]), DEPTH_M


def _free(state: State) -> Iterator[Places]:
    """Places of the clearances of parts that are not to touch: of all their points, in those frames."""
    targets = state.problem.observations.targets
    if targets is not None:
        for column in np.flatnonzero(targets.free.any(axis=0)):
            frames = np.flatnonzero(targets.free[:, column])
            rows = state.problem.contacts.parts[column][:, None]
            support = state.clearance_m[:, rows, frames].argmin(axis=0)  # (P, F)
            yield support, np.broadcast_to(rows, support.shape), np.broadcast_to(frames, support.shape)


def _in(at: Places, frames: Flags) -> Places:
    """Those of some frames (T,)."""
    support, point, frame = at
    rows = np.flatnonzero(frames)
    return support[rows], point[rows], frame[rows]


def _staying(problem: Problem) -> Iterator[tuple[str, IntArray, Array]]:
    """Each part that stays, rows (P,) of its points, and the steps (T - 1,) in which it does."""
    targets = problem.observations.targets
    if targets is not None:
        steps = targets.stay[1:] & targets.stay[:-1]  # (T - 1, parts)
        for column in np.flatnonzero(steps.any(axis=0)):
            rows = problem.contacts.parts[column]
            yield targets.parts[column], rows, steps[:, column].astype(np.float64)
