"""How all that terms look at moves with the coordinates of the model, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.sim.address import Address
from simrecon.types import Array, IntArray


@dataclass(frozen=True, eq=False)
class Moves:
    """Derivatives of what `Seen` shows with respect to V coordinates, at F frames.

    The coordinates are tangents of qpos, and then the wrenches on bodies that are felt, which come from the
    steps before a frame.

    Attributes:
        com: (F, 3, V). points: (F, M, 3, V). wrenches: (F, K, 6, V).
        dofs: (17, 3) degree of freedom of each component of the turn of root and joints, in their own frames.
    """

    com: Array
    points: Array
    wrenches: Array
    dofs: IntArray

    @classmethod
    def of(cls, com: Array, points: Array, person: Address, felt: int = 0) -> Moves:
        """Of derivatives of a person's centre of mass (F, 3, nv) and points (F, M, 3, nv); K `felt`."""
        nv, size = com.shape[-1], 6 * felt
        wrenches = np.zeros((len(com), felt, 6, nv + size))
        wrenches[..., nv:] = np.eye(size).reshape(felt, 6, size)
        com, points = (
            np.concatenate((own, np.zeros((*own.shape[:-1], size))), axis=-1) for own in (com, points)
        )
        return cls(com, points, wrenches, np.arange(person.qvel.start + 3, person.qvel.stop).reshape(-1, 3))

    def of_turns(self, slopes: Array, joints: slice = slice(None)) -> Array:
        """Chain rule (F, B, d, V) of vectors that depend on one turn each, by (F, B, d, 3); B of `joints`."""
        rows = self.dofs[joints]
        moved = np.zeros((*slopes.shape[:3], self.com.shape[-1]))
        moved[:, np.arange(len(rows))[:, None], :, rows] = slopes.transpose(1, 3, 0, 2)
        return moved
