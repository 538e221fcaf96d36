"""Terms of the centre of mass."""

from __future__ import annotations

import numpy as np

from simrecon.kinematics import bands
from simrecon.kinematics.contacts import SIGMA_TOUCH_M, Places, lowest
from simrecon.kinematics.gradient import Gradient
from simrecon.kinematics.hessian import Hessian
from simrecon.kinematics.state import State
from simrecon.kinematics.terms.kernels import acceleration, cauchy
from simrecon.kinematics.terms.term import Term
from simrecon.types import Array

# A person is pushed sideways by friction only, and upwards by a few times body weight at most.
SIGMA_COM_MPS2 = np.array([3.0, 3.0, 10.0])
SIGMA_BALANCE_M = 0.08
# From this certainty on a foot counts as support.
STANDS = 0.3
GRAVITY_MPS2 = 9.81


class SmoothCom(Term):
    """The centre of mass accelerates no more than legs and friction can make it."""

    name = "smooth_com"
    temporal = True
    listed = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Squared acceleration."""
        loss, slope = acceleration(state.com_m[None] / SIGMA_COM_MPS2, state.dt, 1.0)
        gradient.com += unit * slope[0] / SIGMA_COM_MPS2
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """Of each axis."""
        for axis, sigma in enumerate(SIGMA_COM_MPS2):
            chain = bands.second_differences(state.problem.frames, 2 * weight / (state.dt**3 * sigma**2))
            hessian.com.append((slice(axis, axis + 1), chain))


class Balance(Term):
    """The person stands over the feet (`balance`), unless hips at rest near an item bear, too."""

    name = "balance"
    needs_floor = True

    def loss(self, state: State, gradient: Gradient, unit: float) -> float:
        """Robust distance of the zero-moment point from the standing feet."""
        see, touch = state.problem.observations, state.problem.contacts
        seated, hips, fading = _seated(state)
        loss, d_com, d_feet, d_borne = balance(
            _over_ground(state), state.soles_m, see.standing, 1 - seated, state.dt, SIGMA_BALANCE_M
        )
        gradient.com += unit * d_com
        gradient.spheres[touch.soles] += unit * d_feet[:, None] / touch.soles.shape[1]
        gradient.clearances[hips] += unit * d_borne * fading
        return unit * loss

    def curvature(self, state: State, hessian: Hessian, weight: float) -> None:
        """By the centre of mass, with the nearer foot as the support."""
        frames, dt = state.problem.frames, state.dt
        if frames < 3:
            return
        com, feet = _over_ground(state), state.soles_m
        far = np.linalg.norm(com[1:-1, :2] - feet[:, 1:-1, :2], axis=-1).min(axis=0)
        share = state.problem.observations.standing[:, 1:-1].max(axis=0)
        share = share / (1 + (far / SIGMA_BALANCE_M) ** 2)
        lever = com[1:-1, 2] / (GRAVITY_MPS2 * dt**2)
        rows = np.stack((-lever, 1 + 2 * lever, -lever), axis=-1)
        unit = 2 * weight * dt / SIGMA_BALANCE_M**2
        hessian.com.append((slice(0, 2), bands.squared(unit * share, rows, frames)))


def _over_ground(state: State) -> Array:
    """The centre of mass with its height over the floor, (T, 3)."""
    return np.asarray(state.com_m - [0.0, 0.0, state.problem.scene.ground.height_m])


def _seated(state: State) -> tuple[Array, Places, Array]:
    """How surely something but the feet bears the person (T,): hips at rest near an item.

    With the places of the clearances (S, G, T) that say so, and minus the derivative by them.
    """
    clearance = state.clearance_m
    frames = np.arange(clearance.shape[2])
    if len(clearance) == 1:  # nothing but the ground
        none = np.zeros(len(frames), np.int64)
        return np.zeros(len(frames)), (none, none, frames), np.zeros(len(frames))
    hips = lowest(state.problem.contacts.seat.ravel(), clearance, 1)
    far = np.maximum(clearance[hips], 0.0) / SIGMA_TOUCH_M
    seated = state.problem.observations.sitting / (1 + far**2)
    return seated, hips, seated * 2 * far / (1 + far**2) / SIGMA_TOUCH_M


def balance(
    com_m: Array, feet_m: Array, standing: Array, borne: Array, interval_s: float, sigma: float
) -> tuple[float, Array, Array, Array]:
    """Distance of the zero-moment point from the support of the standing feet, robust.

    The ground can only push where the person stands: the point c_xy - c_z c̈_xy / g (Vukobratović 1972, for a
    body that does not spin) lies within the feet, or on the line between them. It ties the trunk, whose depth
    one camera hardly sees, to the feet, whose depth the floor gives.

    Args:
        com_m: (T, 3) centre of mass, heights over the floor.
        feet_m: (2, T, 3) middle of the left and the right sole.
        standing: (2, T) how surely each foot stands, 0 to 1; frames without one don't count.
        borne: (T,) how surely nothing but the feet bears the person, 0 to 1.
        interval_s: between frames.
        sigma: distance at which the pull begins to fade, about half the length of a foot. A margin
            without any pull, and a stiff one beyond, would be as right, but hard to search.

    Returns:
        The loss and its gradients, (T, 3) of the centre of mass, (2, T, 3) of the feet, (T,) of `borne`.
    """
    g = GRAVITY_MPS2
    acceleration = (com_m[2:, :2] - 2 * com_m[1:-1, :2] + com_m[:-2, :2]) / interval_s**2  # (T - 2, 2)
    height = com_m[1:-1, 2:]
    point = com_m[1:-1, :2] - height * acceleration / g  # (T - 2, 2)
    left, right = feet_m[:, 1:-1, :2]
    sure = standing[:, 1:-1]
    across = right - left
    along = np.sum((point - left) * across, axis=-1) / np.maximum(np.sum(across**2, axis=-1), 1e-9)
    low, high = np.where(sure[0] < STANDS, 1.0, 0.0), np.where(sure[1] < STANDS, 0.0, 1.0)
    share = np.clip(along, np.minimum(low, high), np.maximum(low, high))[
        :, None
    ]  # (T - 2, 1) 0 left, 1 right
    offset = point - (1 - share) * left - share * right  # (T - 2, 2)
    loss, slope = cauchy(np.sum(offset**2, axis=-1) / sigma**2)
    sure_of = np.where((sure >= STANDS).any(axis=0), sure.max(axis=0), 0.0)
    weight = sure_of * borne[1:-1]
    d_borne = np.zeros(len(com_m))
    d_borne[1:-1] = sure_of * loss
    d_point = (2 * weight * slope / sigma**2)[:, None] * offset  # (T - 2, 2)
    d_com, d_feet = np.zeros_like(com_m), np.zeros_like(feet_m)
    lever = d_point * -height / (g * interval_s**2)
    d_com[1:-1, :2] += d_point - 2 * lever
    d_com[2:, :2] += lever
    d_com[:-2, :2] += lever
    d_com[1:-1, 2] -= np.sum(d_point * acceleration, axis=-1) / g
    d_feet[0, 1:-1, :2] = -(1 - share) * d_point
    d_feet[1, 1:-1, :2] = -share * d_point
    return float(np.sum(weight * loss)), d_com, d_feet, d_borne
