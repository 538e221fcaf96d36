"""The laws of motion as a term of a whole clip's poses, after Xie 2021, eqs. 1 to 5.

    L = w Δt (Σ_t min_f (½ ‖(w_t - A_t f) / σ‖² + ½ Σ_i k_i ‖f_i‖²) + S),   f_i in the friction cone
    w_t = (Σ m (ẍ - g), Σ m (x - c) × ẍ)
    k_i = (ε_i + (d_i⁺ / σ_d)² + (d_i⁺ / σ_d)⁴ + ‖ẋ_i‖² / σ_v²) / (M g)²

w is what moves the body, about its centre of mass c, by finite differences of its point masses; it is the
root's row of eq. 2, for joints may exert what they like (eq. 3). Contact i at distance d that slips with ẋ
may push, but at a price: eq. 4 with the square of the force in the place of its soft step, and dearer with
the distance, so that nothing pushes from afar. So forces are no unknowns of the search: the best ones
belong to the poses (`forces`). ε_i is ε, and less by a factor for pelvis and thighs, on which one sits
without effort. S is what keeps a plan `steady`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.geometry import rotations
from simrecon.kinematics import forward
from simrecon.kinematics.state import State
from simrecon.planners.soft_contact import forces
from simrecon.planners.soft_contact.asked import Asked
from simrecon.planners.soft_contact.forces import Explained
from simrecon.planners.soft_contact.masses import Masses
from simrecon.planners.soft_contact.scales import Scales
from simrecon.types import Array, IntArray

GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True, eq=False)
class World:
    """What the term knows beside the poses.

    Attributes:
        masses: of the body. stature_m: of it.
        friction: (S,) coefficients of the supports, the ground first.
        scales: units.
        asked: what a user wishes of the contacts of the whole clip, or None.
    """

    masses: Masses
    stature_m: float
    friction: Array
    scales: Scales
    asked: Asked | None = None

    def in_units(self, share: float) -> World:
        """The same in units of force and moment of such a share of weight, and of weight times stature."""
        return replace(self, scales=replace(self.scales, share=share))

    @property
    def weight_N(self) -> float:
        """Of the person."""
        return self.masses.total_kg * float(-GRAVITY[2])

    @property
    def sigma(self) -> Array:
        """Units of force and moment, (6,): N and Nm."""
        return self.scales.share * self.weight_N * np.repeat([1.0, self.stature_m], 3)

    def change(self, dt: float) -> float:
        """Unit of a wrench's change from frame to frame, σ_r Δt, in units of `sigma`."""
        return self.scales.rate_per_s * dt / self.scales.share


class Motion:
    """Point masses and contacts of a state, and what they need.

    Frames 1 to T - 2 have an acceleration; they are the n = T - 2 frames of everything by frame here.

    Attributes:
        masses_m: (N, T, 3); com_m: (T, 3); acceleration: (N, n, 3).
        touching_m: (G, T, 3) where the spheres are nearest to the scene; carried_m: (G, T - 1, 3) the same
            points of the body a frame later; slips: (G, T - 1, 3) their velocity.
        apart_m: (G, T) distances, and normals: (G, T, 3) from the scene.
        wrench: (n, 6) in units of `World.sigma`, cost: (n, G).
    """

    def __init__(self, state: State, world: World) -> None:
        self.state, self.world = state, world
        masses, dt = world.masses, state.dt
        self.masses_m = forward.points(state.pose, masses.segments, state.scale * masses.offsets_m)
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
        self.cost = self._cost()

    def _wrench(self) -> Array:
        """Rate of change of momentum, and weight, (n, 6)."""
        mass = self.world.masses.mass_kg
        push = mass[:, None, None] * self.acceleration
        arms = self.masses_m[:, 1:-1] - self.com_m[1:-1]
        force = push.sum(axis=0) - mass.sum() * GRAVITY
        return np.concatenate((force, forward.cross(arms, push).sum(axis=0)), axis=1)

    def _arms(self, rows: IntArray) -> Array:
        """What unit forces on G' contacts add to force and moment, (n, G', 6, 3)."""
        arm = np.swapaxes(self.touching_m[rows, 1:-1] - self.com_m[1:-1], 0, 1)  # (n, G', 3)
        turning = rotations.skew(arm)
        arms = np.concatenate((np.broadcast_to(np.eye(3), turning.shape), turning), axis=2)
        return np.asarray(arms / self.world.sigma[:, None])

    def _cost(self) -> Array:
        """Price of forces, (n, G)."""
        scales = self.world.scales
        far = np.maximum(self.apart_m[:, 1:-1], 0.0) / scales.distance_m
        slip = np.sum(self.slips**2, axis=2) / scales.slip_mps**2  # (G, T - 1)
        problem = self.state.problem
        rest = scales.rests([problem.skeleton.names[row] for row in problem.contacts.segments])
        price = rest[:, None] + far**2 + far**4 + (slip[:, 1:] + slip[:, :-1]) / 2  # (G, n)
        return np.asarray(price.T / self.world.weight_N**2)

    def explained(self, rows: IntArray, start: Array | None = None) -> Explained:
        """The best forces.

        Args:
            rows: of the contacts that may push, as `within` has them.
            start: (n, 6) residuals to begin with.
        """
        normals = np.swapaxes(self.normals[rows, 1:-1], 0, 1)
        nearest = np.argmin(self.state.clearance_m[:, rows], axis=0)  # (G', T)
        friction = self.world.friction[nearest[:, 1:-1]].T
        cost, wanted = self._costs(rows)
        found = forces.explain(self.wrench, self._arms(rows), cost, normals, friction, start, wanted)
        every = np.zeros((*self.cost.shape, 3))
        every[:, rows] = found.forces
        return replace(found, forces=every)

    def _costs(self, rows: IntArray | slice) -> tuple[Array, Array | None]:
        """Prices (n, G') of contacts with what is asked of them, and forces (n, G', 3) times the latter."""
        cost, asked = self.cost[:, rows], self.world.asked
        if asked is None:
            return cost, None
        price = asked.price[rows, 1:-1].T / self.world.weight_N**2
        wanted = (price * asked.force_N[rows, 1:-1].T)[..., None]
        return cost + price, wanted * np.swapaxes(self.normals[rows, 1:-1], 0, 1)

    def within(self, reach_m: float) -> IntArray:
        """Contacts that come so near to the scene at any time."""
        return np.flatnonzero(self.apart_m.min(axis=1) < reach_m)

    def loss(self, found: Explained) -> float:
        """Sum over frames."""
        cost, wanted = self._costs(slice(None))
        paid = np.sum(cost * np.sum(found.forces**2, axis=2))
        if wanted is not None:
            paid -= 2 * np.sum(wanted * found.forces)
        return 0.5 * float(np.sum(found.residual**2) + paid)

    def gradient(self, found: Explained, by_wrench: Array, by_com: Array) -> tuple[IntArray, Array, Array]:
        """Of `loss`, and of whatever else has slopes by the wrench (n, 6), in its units, and by com_m (T, 3).

        Returns:
            By points of the body: their segments (P,), places (P, T, 3) and the derivative there (P, T, 3).
        """
        touch = self.state.problem.contacts
        masses, touching, by_sphere, carried = self._by_points(found)
        masses += self._by_masses(found.residual + by_wrench)
        masses += self._shared(by_com)
        segments = np.concatenate((self.world.masses.segments, *[touch.segments] * 3))
        ahead = np.concatenate((self.touching_m[:, :1], self.carried_m), axis=1)  # the first has no share
        places = np.concatenate((self.masses_m, self.touching_m, self.state.spheres_m, ahead))
        return segments, places, np.concatenate((masses, touching, by_sphere, carried))

    def _shared(self, by_com: Array) -> Array:
        """Derivative by masses (N, ..., 3) of one by the centre of mass (..., 3)."""
        mass = self.world.masses.mass_kg
        return np.asarray((mass / mass.sum())[:, None, None] * by_com)

    def _by_masses(self, by_wrench: Array) -> Array:
        """Derivative by masses (N, T, 3) of one by the wrench (n, 6), in its units."""
        mass, dt = self.world.masses.mass_kg, self.state.dt
        force, moment = np.split(by_wrench / self.world.sigma, 2, axis=1)
        arms = self.masses_m[:, 1:-1] - self.com_m[1:-1]
        by_acceleration = mass[:, None, None] * (force + forward.cross(moment, arms)) / dt**2
        masses = np.zeros_like(self.masses_m)
        masses[:, 2:] += by_acceleration
        masses[:, 1:-1] -= 2 * by_acceleration
        masses[:, :-2] += by_acceleration
        by_arm = forward.cross(mass[:, None, None] * self.acceleration, moment[None])
        masses[:, 1:-1] += by_arm - self._shared(by_arm.sum(axis=0))
        return masses

    def _by_points(self, found: Explained) -> tuple[Array, Array, Array, Array]:
        """Derivative of what forces explain, and cost.

        Returns:
            By masses (N, T, 3), contacts, spheres and contacts a frame later, (G, T, 3) each.
        """
        dt, scales = self.state.dt, self.world.scales
        moment = (found.residual / self.world.sigma)[:, 3:]  # (n, 3)
        pushed = np.swapaxes(found.forces, 0, 1)  # (G, n, 3)
        lever = forward.cross(pushed, moment[None])  # (G, n, 3)
        masses = np.zeros_like(self.masses_m)
        masses[:, 1:-1] += self._shared(lever.sum(axis=0))

        touching, carried = np.zeros_like(self.touching_m), np.zeros_like(self.touching_m)
        touching[:, 1:-1] -= lever
        priced = self.priced(found)
        by_sphere = np.zeros_like(self.touching_m)
        by_sphere[:, 1:-1] += self.by_distance(priced)[..., None] * self.normals[:, 1:-1]
        step = self.paid_steps(priced)[..., None] * self.slips / (scales.slip_mps**2 * dt)  # (G, T - 1, 3)
        carried[:, 1:] += step
        touching[:, :-1] -= step
        return masses, touching, by_sphere, carried

    def priced(self, found: Explained) -> Array:
        """Squared forces in body weights, (G, n)."""
        return np.asarray(np.sum(np.swapaxes(found.forces, 0, 1) ** 2, axis=2) / self.world.weight_N**2)

    def by_distance(self, priced: Array) -> Array:
        """Derivative of what forces cost by the distances of the spheres, (G, n)."""
        unit = self.world.scales.distance_m
        far = np.maximum(self.apart_m[:, 1:-1], 0.0) / unit
        return np.asarray(priced * (far + 2 * far**3) / unit)

    def paid_steps(self, priced: Array) -> Array:
        """Squared forces (G, n), in body weights, as the mean of the two frames of each step, (G, T - 1)."""
        padded = np.pad(priced, ((0, 0), (1, 1)))
        return np.asarray((padded[:, 1:] + padded[:, :-1]) / 2)
