"""The sprung sheet of an item: a mat, the mattress of a bed, or the membrane of a trampoline."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from simrecon.types import Array, SceneItem

TILE_KG_PER_M2 = 4.0
"""Of a foam tile: it only has to be light against a person."""
RATED_KG = 70.0
"""Load for which natural frequencies are stated."""
PATCH_M = 0.3
"""Edge of the square under the load for which a trampoline's stiffness is stated."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A rectangle of sprung tiles, each of which moves up and down only; in the item's frame.

    Attributes:
        centre_m: (3,) of its upper side at rest.
        size_m: along x and y; tiles: number along x and y.
        depth_m: how far a tile may sink.
        stiffness_Npm: of each tile against what carries it; tension_Npm: along x and y between neighbours.
        rim: whether a rim holds the tiles at the edge as well.
        damping_s: damping over stiffness, the same everywhere.
        tile_kg: mass of a tile.
    """

    centre_m: Array
    size_m: tuple[float, float]
    tiles: tuple[int, int]
    depth_m: float
    stiffness_Npm: float
    tension_Npm: tuple[float, float]
    rim: bool
    damping_s: float
    tile_kg: float

    def matrix(self) -> Array:
        """Stiffness (n, n) in N/m by the sinks of the n tiles, x outer, y inner."""
        (nx, ny), (tx, ty) = self.tiles, self.tension_Npm
        rows = [_chain(count, self.rim) for count in (nx, ny)]
        coupled = tx * np.kron(rows[0], np.eye(ny)) + ty * np.kron(np.eye(nx), rows[1])
        return np.asarray(coupled + self.stiffness_Npm * np.eye(nx * ny))


def sheet_of(item: SceneItem) -> Sheet | None:
    """The sprung sheet of an item, or None if it has none."""
    values: dict[str, Any] = dict(item.parameters)
    if item.kind == "trampoline":
        return _membrane(values)
    if item.kind == "mat":
        return _foam(values, values["height_m"])
    if item.kind == "bed" and values["stiffness_Npm3"] > 0:
        return _foam(values, values["mattress_m"])
    return None


def depth_m(item: SceneItem) -> float:
    """How far the sprung sheet of an item may sink; 0 without one."""
    sheet = sheet_of(item)
    return 0.0 if sheet is None else sheet.depth_m


def natural_frequency_hz(item: SceneItem) -> float:
    """Natural frequency of a trampoline with `RATED_KG` in its middle."""
    return float(np.sqrt(float(str(item.parameters["stiffness_Npm"])) / RATED_KG) / (2 * np.pi))


def _foam(values: dict[str, Any], thickness_m: float) -> Sheet:
    """Tiles that don't pull at each other."""
    size = (values["length_m"], values["width_m"])
    nx, ny = (max(1, int(np.ceil(edge / values["tile_m"] - 1e-9))) for edge in size)
    area = size[0] * size[1] / (nx * ny)
    return Sheet(
        np.array([0.0, 0.0, values["height_m"]]),
        size,
        (nx, ny),
        0.95 * thickness_m,
        values["stiffness_Npm3"] * area,
        (0.0, 0.0),
        False,
        values["damping_Nspm3"] / values["stiffness_Npm3"],
        TILE_KG_PER_M2 * area,
    )


def _membrane(values: dict[str, Any]) -> Sheet:
    """Tension from the stiffness in the middle: the discrete membrane T ∇²u = -p, solved once for T = 1."""
    size = (values["length_m"], values["width_m"])
    edge = min(size) / values["tiles"]
    nx, ny = (max(3, round(length / edge)) for length in size)
    dx, dy = size[0] / nx, size[1] / ny

    def stretched(tension: float) -> Sheet:
        return Sheet(
            np.array([0.0, 0.0, values["height_m"]]),
            size,
            (nx, ny),
            0.95 * values["height_m"],
            0.0,
            (tension * dy / dx, tension * dx / dy),
            True,
            values["damping_Nspm"] / values["stiffness_Npm"],
            values["mass_of_bed_kg"] / (nx * ny),
        )

    unit = stretched(1.0)
    load = np.outer(_covered(nx, dx), _covered(ny, dy)).ravel()  # (n,) share of a unit load on each tile
    sink = float(load @ np.linalg.solve(unit.matrix(), load))
    return stretched(values["stiffness_Npm"] * sink)


def _covered(count: int, edge_m: float) -> Array:
    """Share (count,) of a load on the middle `PATCH_M` that each tile of a row bears."""
    edges = (np.arange(count + 1) - count / 2) * edge_m
    inside = np.clip(edges, -PATCH_M / 2, PATCH_M / 2)
    return np.asarray(np.diff(inside) / PATCH_M)


def _chain(count: int, rim: bool) -> Array:
    """Stiffness (count, count) of unit springs between neighbours, and to a rim half a spacing away."""
    matrix = np.zeros((count, count))
    for i in range(count - 1):
        matrix[i : i + 2, i : i + 2] += [[1, -1], [-1, 1]]
    if rim:
        matrix[0, 0] += 2
        matrix[-1, -1] += 2
    return matrix
