"""The sizes ψ of all primitives as one vector, and ψ(β) by a small neural network (Gärtner 2022, appendix A).

Left side and centre only. ψ is linear in end points, centres, radii and half sizes: capsules across the body
(ends at (x, ±y, z)), in its middle plane (both ends at y = 0) and anywhere, and boxes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from simrecon import resources
from simrecon.body.primitives import entries
from simrecon.errors import SimreconError
from simrecon.types import Array

SCHEMA = "simrecon.primitives/1"
VALUES = 9
"""Numbers of a primitive: capsule ends (3), (3), radius, 0, 0; box centre (3), 0, 0, 0, half sizes (3)."""
LEAST_M = 0.005
"""Least radius or half size."""


@dataclass(frozen=True, eq=False)
class Layout:
    """How ψ maps to primitives. E primitives of the left side and the centre, S sizes.

    Attributes:
        names, segments, kinds: (E,) of the primitives.
        central: (E,) whether it lies across or in the middle plane.
        matrix: (E, 9, S) values of each primitive = matrix @ ψ.
        lower: (S,) least values; minus infinity for places.
    """

    names: tuple[str, ...]
    segments: tuple[str, ...]
    kinds: tuple[str, ...]
    central: tuple[bool, ...]
    matrix: Array
    lower: Array


@cache
def layout() -> Layout:
    """The layout of the primitives of `models/body/primitives.toml`."""
    chosen = [entry for entry in entries() if not entry["name"].startswith("right_")]
    blocks, lower, central = [], [], []
    for entry in chosen:
        centre = not entry["name"].startswith("left_")
        sagittal = centre and entry.get("from", [0, 1, 0])[1] == 0
        block, least = _box() if entry["kind"] == "box" else _capsule(centre, sagittal)
        blocks.append(block)
        lower.append(least)
        central.append(centre)
    matrix = np.zeros((len(blocks), VALUES, sum(block.shape[1] for block in blocks)))
    start = 0
    for i, block in enumerate(blocks):
        matrix[i, :, start : start + block.shape[1]] = block
        start += block.shape[1]
    return Layout(
        tuple(entry["name"] for entry in chosen),
        tuple(entry["segment"] for entry in chosen),
        tuple(entry["kind"] for entry in chosen),
        tuple(central),
        matrix,
        np.concatenate(lower),
    )


def _capsule(centre: bool, sagittal: bool) -> tuple[Array, Array]:
    """Block (9, s) and lower bounds (s,) of a capsule."""
    rows: list[list[tuple[int, float]]] = [[(i, 1.0)] for i in range(7)]
    low = [-np.inf] * 6 + [LEAST_M]
    if centre and sagittal:  # x z of both ends, radius
        rows, low = [[(0, 1.0)], [(2, 1.0)], [(3, 1.0)], [(5, 1.0)], [(6, 1.0)]], [-np.inf] * 4 + [LEAST_M]
    elif centre:  # x, z, half length, radius
        rows = [[(0, 1.0), (3, 1.0)], [(2, 1.0), (5, 1.0)], [(1, -1.0), (4, 1.0)], [(6, 1.0)]]
        low = [-np.inf, -np.inf, LEAST_M, LEAST_M]
    return _block(rows), np.array(low)


def _box() -> tuple[Array, Array]:
    rows = [[(i, 1.0)] for i in (0, 1, 2, 6, 7, 8)]
    return _block(rows), np.array([-np.inf] * 3 + [LEAST_M] * 3)


def _block(rows: list[list[tuple[int, float]]]) -> Array:
    block = np.zeros((VALUES, len(rows)))
    for column, places in enumerate(rows):
        for row, factor in places:
            block[row, column] = factor
    return block


@cache
def _network() -> tuple[tuple[Array, Array], ...]:
    path = resources.folder("models") / "body" / "primitives.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            if str(data["schema"]) != SCHEMA:
                raise ValueError(f"schema is {data['schema']}")
            return tuple((data[f"weight_{i}"], data[f"bias_{i}"]) for i in range(3))
    except (OSError, ValueError, KeyError) as error:
        raise SimreconError(f"cannot read {path}: {error}; install simrecon again") from error


def regress(betas: Array) -> Array:
    """Sizes ψ (..., S), m, of shapes (..., 10): two hidden layers of 256, Gärtner 2022, appendix A."""
    hidden = np.asarray(betas, dtype=np.float32)
    *layers, (weight, bias) = _network()
    for inner, offset in layers:
        hidden = np.maximum(hidden @ inner + offset, 0.0)  # (..., 256)
    return np.maximum((hidden @ weight + bias).astype(np.float64), layout().lower)


def values(sizes: Array) -> Array:
    """Values (..., E, 9) of the primitives (see `VALUES`) of sizes (..., S)."""
    return np.asarray(np.einsum("evs,...s->...ev", layout().matrix, sizes))


def pack(values: Array) -> Array:
    """Sizes (S,) of the primitives' values (E, 9): the inverse of `values`."""
    matrix = layout().matrix.reshape(-1, layout().matrix.shape[-1])
    return np.asarray(np.linalg.lstsq(matrix, values.ravel(), rcond=None)[0])
