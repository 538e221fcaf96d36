"""References (`simrecon.truth/1`), and the names of joints that all scores share."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simrecon.body.primitives import FEET
from simrecon.errors import InputError
from simrecon.io.arrays import Arrays
from simrecon.io.npz import load
from simrecon.types import Array

TRUTH_SCHEMA = "simrecon.truth/1"
SIDES = ("left", "right")
BODY_JOINTS = tuple(
    f"{side}_{joint}" for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist") for side in SIDES
)
"""The 12 joints of every position score, hips first."""
FOOT_POINTS = ("left_heel", "right_heel", "left_toe", "right_toe")
ALIASES = {"left_foot_index": "left_toe", "right_foot_index": "right_toe"}
CUTOFF_HZ = 20.0
"""Low-pass of force comparisons where the reference names none (`grf_cutoff_hz`): keeps a heel strike."""


@dataclass(frozen=True, eq=False)
class Plates:
    """What force plates measured under each foot, on the times of the reference.

    Attributes:
        force_N: (T, 2, 3) on the left and the right foot, world.
        centre_m: (T, 2, 3) centre of pressure of each foot, NaN where the plate is not loaded; or None.
        known: (T,) frames in which no foot stood beside its plate.
        cutoff_hz: low-pass of both sides of a comparison.
    """

    force_N: Array
    centre_m: Array | None
    known: NDArray[np.bool_]
    cutoff_hz: float = CUTOFF_HZ


@dataclass(frozen=True, eq=False)
class Pushes:
    """What the scene does to each primitive of a reference that was simulated.

    Attributes:
        names: C primitives.
        force_N: (T, C, 3) in the world, mean since the frame before; of an instant in the first frame.
    """

    names: tuple[str, ...]
    force_N: Array

    def on(self, names: Sequence[str]) -> Array:
        """The force on some of them, (T, len(names), 3)."""
        return np.asarray(self.force_N[:, [self.names.index(name) for name in names]])


@dataclass(frozen=True, eq=False)
class Truth:
    """A reference (`simrecon.truth/1`): times (T,), K names, joints (T, K, 3) in the world, z up.

    Attributes:
        times_s, joint_names, joints_m: the reference.
        peers: other methods' joints (T, K, 3) on the same clip, by name.
        mass_kg: of the person, or None.
        plates: measured forces, or None.
        pushes: forces on the primitives of a motion that was simulated, or None.
    """

    times_s: Array
    joint_names: tuple[str, ...]
    joints_m: Array
    peers: dict[str, Array] = field(default_factory=dict)
    mass_kg: float | None = None
    plates: Plates | None = None
    pushes: Pushes | None = None


def read_truth(path: str | os.PathLike[str]) -> Truth:
    """Read a reference. Nothing that reconstructs may call this.

    Raises:
        InputError: one line with file, key, what was found and what is valid.
    """
    arrays = load(path)
    arrays.text("schema", (TRUTH_SCHEMA,))
    times = arrays.finite("times_s", ("T",))
    if (np.diff(times) <= 0).any():
        arrays.fail("times_s", "times that do not increase", "increasing times in seconds")
    names = arrays.names("joint_names", "K")
    joints = arrays.finite("joints_m", ("T", "K", 3))
    peers: dict[str, Array] = {}
    if "peer_joints_m" in arrays:
        methods = arrays.names("peer_names", "P")
        others = arrays.finite("peer_joints_m", ("P", "T", "K", 3))
        peers = dict(zip(methods, others, strict=True))
    mass = arrays.scalar("mass_kg", (5.0, 400.0), "kg") if "mass_kg" in arrays else None
    pushes = _pushes(arrays)
    return Truth(times, names, joints, peers, mass, None if pushes else _plates(arrays), pushes)


def _pushes(arrays: Arrays) -> Pushes | None:
    if "contact_force_N" not in arrays:
        return None
    names = arrays.names("contact_body", "C")
    if missing := [foot for foot in FEET if foot not in names]:
        arrays.fail("contact_body", f"no {' and no '.join(missing)}", "both feet among them")
    return Pushes(names, arrays.finite("contact_force_N", ("T", "C", 3)))


def _plates(arrays: Arrays) -> Plates | None:
    if "grf_left_N" not in arrays and "grf_right_N" not in arrays:
        return None
    force = np.stack([arrays.finite(f"grf_{side}_N", ("T", 3)) for side in SIDES], axis=1)  # (T, 2, 3)
    centre = None
    if "cop_left_m" in arrays:
        centre = np.stack([arrays.floats(f"cop_{side}_m", ("T", 3)) for side in SIDES], axis=1)
    known = np.ones(len(force), dtype=bool)
    if "grf_known" in arrays:
        known = arrays.array("grf_known").astype(bool)
        if known.shape != (len(force),):
            arrays.fail("grf_known", f"shape {known.shape}", f"shape ({len(force)},)")
    cutoff = CUTOFF_HZ
    if "grf_cutoff_hz" in arrays:
        cutoff = arrays.scalar("grf_cutoff_hz", (0.1, 1000.0), "Hz")
    return Plates(force, centre, known, cutoff)


def canonical(names: Sequence[str]) -> tuple[str, ...]:
    """Names with the aliases of foot points resolved."""
    return tuple(ALIASES.get(name, name) for name in names)


def check_names(whose: str, names: Sequence[str]) -> None:
    """Check that all joints of the position scores are there.

    Args:
        whose: for the message.
        names: from `canonical`.

    Raises:
        InputError: names the missing ones.
    """
    if missing := [joint for joint in BODY_JOINTS if joint not in names]:
        valid = f"all of {', '.join(BODY_JOINTS)}"
        raise InputError(f"joint_names of the {whose}: found no {', '.join(missing)}; valid: {valid}")
