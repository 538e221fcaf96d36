"""Rotations of Euler angles, and what turns a body, in CasADi's symbols."""

from __future__ import annotations

import casadi as ca

from simrecon.planners.centroidal.curves import Symbols
from simrecon.planners.centroidal.euler import Axes


def rotation(axes: Axes) -> ca.Function:
    """Euler angles (1, 3) → rotation (3, 3)."""
    turn = ca.SX.sym("turn", 1, 3)
    product = _about(axes[0], turn[0]) @ _about(axes[1], turn[1]) @ _about(axes[2], turn[2])
    return ca.Function("rotation", [turn], [product])


def turning(axes: Axes) -> ca.Function:
    """What turns a body less what moments do, (3,), on the axes of the body.

    Of angles, their velocities and accelerations (1, 3), inertia (3, 3) and moment in the world (1, 3).
    """
    turn, rate, bend = (ca.SX.sym(name, 1, 3) for name in ("turn", "rate", "bend"))
    inertia, moment = ca.SX.sym("inertia", 3, 3), ca.SX.sym("moment", 1, 3)
    spin = _spin(axes, turn, rate)
    quicker = ca.jtimes(spin, turn, rate) + ca.jtimes(spin, rate, bend)
    pushed = rotation(axes)(turn).T @ moment.T
    return ca.Function(
        "turning", [turn, rate, bend, inertia, moment],
        [inertia @ quicker + ca.cross(spin, inertia @ spin) - pushed],
    )  # fmt: skip


def momentum(axes: Axes) -> ca.Function:
    """Angular momentum in the world, (3,).

    Of angles and their velocities (1, 3), and inertia (3, 3) and momentum of limbs (1, 3) on the body's axes.
    """
    turn, rate = (ca.SX.sym(name, 1, 3) for name in ("turn", "rate"))
    inertia, swing = ca.SX.sym("inertia", 3, 3), ca.SX.sym("swing", 1, 3)
    held = rotation(axes)(turn)
    return ca.Function(
        "momentum", [turn, rate, inertia, swing], [held @ (inertia @ _spin(axes, turn, rate) + swing.T)]
    )


def _spin(axes: Axes, turn: Symbols, rate: Symbols) -> Symbols:
    """Angular velocity (3,) on the axes of the body."""
    second, third = (_about(axes[k], turn[k]) for k in (1, 2))
    unit = ca.DM.eye(3)
    spin = rate[0] * (second @ third).T @ unit[:, axes[0]]
    return spin + rate[1] * third.T @ unit[:, axes[1]] + rate[2] * unit[:, axes[2]]


def _about(axis: int, angle: Symbols) -> Symbols:
    """Rotation about x, y or z."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made = ca.SX.eye(3)
    made[i, i] = made[j, j] = ca.cos(angle)
    made[j, i] = ca.sin(angle)
    made[i, j] = -ca.sin(angle)
    return made
