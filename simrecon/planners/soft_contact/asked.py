"""What a user wishes of the contacts, as forces: what is to touch bears something, what is free nothing.

    ½ Σ_i η_i ‖f_i - f°_i n_i‖² / (M g)²

is added to the price of the forces (`physics`), with f° the force wanted of contact i, η_i a constant where
one is wanted, and n_i the normal of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simrecon.contact import rules
from simrecon.kinematics.layout import Variables
from simrecon.kinematics.problem import Problem
from simrecon.kinematics.state import State
from simrecon.types import Array

SHARE = 0.1
"""Of body weight that a part bears which is to touch: three times what counts as a push."""
PULL, BARRED = 1e3, 1e4
"""η, and the price of a force on what is to be free."""


@dataclass(frozen=True, eq=False)
class Asked:
    """By contact and frame.

    Attributes:
        force_N: (G, T) f°, zero where none is wanted.
        price: (G, T) what is added to that of the force, η or that of what is to be free, in body weights.
    """

    force_N: Array
    price: Array


def asked(problem: Problem, variables: Variables, weight_N: float) -> Asked | None:
    """What is wished of the contacts of a problem.

    Args:
        problem: with those wishes in it that can hold.
        variables: a motion that is bent to them; points that are about as near as the nearest of a part
            share what it is to bear.
        weight_N: of the person.

    Returns:
        None if nothing is wished.
    """
    targets = problem.observations.targets
    if targets is None:
        return None
    apart_m, _ = State(problem, variables).nearest  # (G, T)
    force, price = np.zeros_like(apart_m), np.zeros_like(apart_m)
    for column, rows in enumerate(problem.contacts.parts):
        near = rules.near(apart_m[rows] - np.maximum(apart_m[rows].min(axis=0), 0.0))
        near &= targets.touch[:, column] & rules.near(apart_m[rows].min(axis=0))
        force[rows] = SHARE * weight_N * near / np.maximum(near.sum(axis=0), 1)
        price[rows] = np.where(near, PULL, BARRED * targets.free[:, column])
    return Asked(force, price)
