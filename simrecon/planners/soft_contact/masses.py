"""A person as a few point masses: each rigid segment has six that move it like the segment itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simrecon.geometry import rotations
from simrecon.sim.address import locate
from simrecon.sim.models import compile_text
from simrecon.types import Array, Body, IntArray


@dataclass(frozen=True, eq=False)
class Masses:
    """Point masses that are equimomental with a person's rigid segments.

    A segment of mass m with principal second moments p_k about its centre, p_k = Σ_j I_j / 2 - I_k, has the
    same mass, centre and inertia as points of m / 6 at ± √(3 p_k / m) on its principal axes.

    Attributes:
        segments: (N,) segment of each; offsets_m: (N, 3) in its frame.
        mass_kg: (N,).
    """

    segments: IntArray
    offsets_m: Array
    mass_kg: Array

    @classmethod
    def of(cls, body: Body) -> Masses:
        """Those of a body."""
        model = compile_text(body.mjcf)
        first, count = locate(model).body, len(body.skeleton.names)
        own = slice(first, first + count)
        mass, inertia = model.body_mass[own], model.body_inertia[own]  # (S,), (S, 3)
        axes = rotations.matrix(model.body_iquat[own])  # (S, 3, 3), columns are principal axes
        second = np.maximum(inertia.sum(axis=1, keepdims=True) / 2 - inertia, 0.0)
        reach = np.sqrt(3 * second / mass[:, None])  # (S, 3)
        arms = np.swapaxes(axes * reach[:, None, :], 1, 2)  # (S, 3, 3), rows
        offsets = model.body_ipos[own][:, None] + np.concatenate((arms, -arms), axis=1)  # (S, 6, 3)
        return cls(np.repeat(np.arange(count), 6), offsets.reshape(-1, 3), np.repeat(mass / 6, 6))

    def scaled(self, factor: float) -> Masses:
        """The same masses with all lengths times a factor."""
        return replace(self, offsets_m=factor * self.offsets_m)

    @property
    def total_kg(self) -> float:
        """Mass of the person."""
        return float(self.mass_kg.sum())

    def centre_m(self, points_m: Array) -> Array:
        """Centre of mass (T, 3) of the points (N, T, 3)."""
        return np.asarray(np.tensordot(self.mass_kg / self.total_kg, points_m, axes=1))
