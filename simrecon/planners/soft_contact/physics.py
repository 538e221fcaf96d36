"""The laws of motion as a term of a whole clip's poses, after Xie 2021, eqs. 1 to 5.

    L = w Δt Σ_t min_f (½ ‖(w_t - A_t f) / σ‖² + ½ Σ_i k_i ‖f_i‖²),   f_i in the friction cone
    w_t = (Σ m (ẍ - g), Σ m (x - c) × ẍ)
    k_i = (ε + (d_i⁺ / σ_d)² + ‖ẋ_i‖² / σ_v²) / (M g)²

w is what moves the body, about its centre of mass c, by finite differences of its point masses; it is the
root's row of eq. 2, for joints may exert what they like (eq. 3). Contact i at distance d that slips with ẋ
may push, but at a price: eq. 4 with the square of the force in the place of its soft step. So forces are no
unknowns of the search: the best ones belong to the poses (`forces`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.kinematics.state import State
from simrecon.planners.soft_contact import forces
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.masses import Masses
from simrecon.types import Array, IntArray

GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True)
class Scales:
    """Units of the term.

    Attributes:
        force, moment: σ of force and moment as shares of body weight, and of body weight times stature.
        distance_m, slip_mps: σ_d and σ_v.
        rest: ε.
    """

    force: float = 0.05
    moment: float = 0.05
    distance_m: float = 0.01
    slip_mps: float = 0.1
    rest: float = 1e-3


@dataclass(frozen=True, eq=False)
class World:
    """What the term knows beside the poses.

    Attributes:
        masses: of the body. stature_m: of it.
        friction: (S,) coefficients of the supports, the ground first.
        scales: units.
    """

    masses: Masses
    stature_m: float
    friction: Array
    scales: Scales = Scales()

    def in_units(self, share: float) -> World:
        """The same in units of force and moment of such a share of weight, and of weight times stature."""
        return replace(self, scales=replace(self.scales, force=share, moment=share))

    @property
    def weight_N(self) -> float:
        """Of the person."""
        return self.masses.total_kg * float(-GRAVITY[2])

    @property
    def sigma(self) -> Array:
        """Units of force and moment, (6,): N and Nm."""
        force, moment = self.scales.force, self.scales.moment * self.stature_m
        return self.weight_N * np.repeat([force, moment], 3)


class Motion:
    """Point masses and contacts of a state, and what they need.

    Frames 1 to T - 2 have an acceleration; they are the n = T - 2 frames of everything by frame here.

    Attributes:
        masses_m: (N, T, 3); com_m: (T, 3); acceleration: (N, n, 3).
        touching_m: (G, T, 3) where the spheres are nearest to the scene; carried_m: (G, T - 1, 3) the same
            points of the body a frame later; slips: (G, T - 1, 3) their velocity.
        apart_m: (G, T) distances, and normals: (G, T, 3) from the scene.
        wrench: (n, 6) in units of `World.sigma`, arms: (n, G, 6, 3), cost: (n, G).
    """

    def __init__(self, state: State, world: World) -> None:
        self.state, self.world = state, world
        masses, dt = world.masses, state.dt
        self.masses_m = forward.points(state.pose, masses.segments, masses.offsets_m)
        self.com_m = masses.centre_m(self.masses_m)
        x = self.masses_m
        self.acceleration = (x[:, 2:] - 2 * x[:, 1:-1] + x[:, :-2]) / dt**2
        self.apart_m, self.normals = state.nearest
        touch = state.problem.contacts
        down = -state.scale * touch.radii_m[:, None, None] * self.normals
        self.touching_m = state.spheres_m + down
        axes = state.pose.axes  # (S, T, 3, 3)
        turn = (axes[:, 1:] @ np.swapaxes(axes[:, :-1], -1, -2))[touch.segments]  # (G, T - 1, 3, 3)
        self.carried_m = state.spheres_m[:, 1:] + (turn @ down[:, :-1, :, None])[..., 0]
        self.slips = (self.carried_m - self.touching_m[:, :-1]) / dt
        self.wrench = self._wrench() / world.sigma
        self.arms = self._arms() / world.sigma[:, None]
        self.cost = self._cost()

    def _wrench(self) -> Array:
        """Rate of change of momentum, and weight, (n, 6)."""
        mass = self.world.masses.mass_kg
        push = mass[:, None, None] * self.acceleration
        arms = self.masses_m[:, 1:-1] - self.com_m[1:-1]
        force = push.sum(axis=0) - mass.sum() * GRAVITY
        return np.concatenate((force, forward.cross(arms, push).sum(axis=0)), axis=1)

    def _arms(self) -> Array:
        """What unit forces on the contacts add to force and moment, (n, G, 6, 3)."""
        arm = np.swapaxes(self.touching_m[:, 1:-1] - self.com_m[1:-1], 0, 1)  # (n, G, 3)
        turning = rotations.skew(arm)
        return np.concatenate((np.broadcast_to(np.eye(3), turning.shape), turning), axis=2)

    def _cost(self) -> Array:
        """Price of forces, (n, G)."""
        scales = self.world.scales
        far = np.maximum(self.apart_m[:, 1:-1], 0.0) / scales.distance_m
        slip = np.sum(self.slips**2, axis=2) / scales.slip_mps**2  # (G, T - 1)
        price = scales.rest + far**2 + (slip[:, 1:] + slip[:, :-1]) / 2  # (G, n)
        return np.asarray(price.T / self.world.weight_N**2)

    def explained(self, start: Array | None = None) -> Explained:
        """The best forces; start: (n, 6) residuals to begin with."""
        normals = np.swapaxes(self.normals[:, 1:-1], 0, 1)
        nearest = np.argmin(self.state.clearance_m, axis=0)  # (G, T)
        friction = self.world.friction[nearest[:, 1:-1]].T
        return forces.explain(self.wrench, self.arms, self.cost, normals, friction, start)

    def loss(self, found: Explained) -> float:
        """Sum over frames."""
        paid = np.sum(self.cost * np.sum(found.forces**2, axis=2))
        return 0.5 * float(np.sum(found.residual**2) + paid)

    def gradient(self, found: Explained) -> tuple[IntArray, Array, Array]:
        """By points of the body: their segments (P,), places (P, T, 3) and the derivative there (P, T, 3)."""
        touch = self.state.problem.contacts
        masses, touching, by_sphere, carried = self._by_points(found)
        segments = np.concatenate((self.world.masses.segments, *[touch.segments] * 3))
        ahead = np.concatenate((self.touching_m[:, :1], self.carried_m), axis=1)  # the first has no share
        places = np.concatenate((self.masses_m, self.touching_m, self.state.spheres_m, ahead))
        return segments, places, np.concatenate((masses, touching, by_sphere, carried))

    def _by_points(self, found: Explained) -> tuple[Array, Array, Array, Array]:
        """Derivative by masses (N, T, 3), contacts, spheres and contacts a frame later, (G, T, 3) each."""
        dt, scales, mass = self.state.dt, self.world.scales, self.world.masses.mass_kg
        by_wrench = found.residual / self.world.sigma  # (n, 6)
        force, moment = by_wrench[:, :3], by_wrench[:, 3:]
        pushed = np.swapaxes(found.forces, 0, 1)  # (G, n, 3)
        arms = self.masses_m[:, 1:-1] - self.com_m[1:-1]
        push = mass[:, None, None] * self.acceleration

        masses = np.zeros_like(self.masses_m)
        by_acceleration = mass[:, None, None] * (force + forward.cross(moment, arms)) / dt**2
        masses[:, 2:] += by_acceleration
        masses[:, 1:-1] -= 2 * by_acceleration
        masses[:, :-2] += by_acceleration
        by_arm = forward.cross(push, moment[None])
        masses[:, 1:-1] += by_arm
        lever = forward.cross(pushed, moment[None])  # (G, n, 3)
        by_com = lever.sum(axis=0) - by_arm.sum(axis=0)
        masses[:, 1:-1] += (mass / mass.sum())[:, None, None] * by_com

        touching, carried = np.zeros_like(self.touching_m), np.zeros_like(self.touching_m)
        touching[:, 1:-1] -= lever
        priced = np.sum(pushed**2, axis=2) / self.world.weight_N**2  # (G, n)
        far = np.maximum(self.apart_m[:, 1:-1], 0.0) / scales.distance_m**2
        by_sphere = np.zeros_like(self.touching_m)
        by_sphere[:, 1:-1] += (priced * far)[..., None] * self.normals[:, 1:-1]
        step = self.paid_steps(priced)[..., None] * self.slips / (scales.slip_mps**2 * dt)  # (G, T - 1, 3)
        carried[:, 1:] += step
        touching[:, :-1] -= step
        return masses, touching, by_sphere, carried

    def paid_steps(self, priced: Array) -> Array:
        """Squared forces (G, n), in body weights, as the mean of the two frames of each step, (G, T - 1)."""
        padded = np.pad(priced, ((0, 0), (1, 1)))
        return np.asarray((padded[:, 1:] + padded[:, :-1]) / 2)
