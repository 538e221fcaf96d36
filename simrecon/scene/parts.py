"""What the things of a scene are made of: solid parts and sprung sheets, in the frame of the thing.

That frame has its origin at the centre of the footprint, at the lowest height, and z up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.spatial import ConvexHull

from simrecon.scene import meshes
from simrecon.types import Array, IntArray, SceneItem

Shape = Literal["box", "sphere", "hull", "field"]


@dataclass(frozen=True, eq=False)
class Part:
    """One solid shape, convex but for a height field.

    Attributes:
        name: within its thing; empty where it is the only part.
        shape: `box`, `sphere`, `hull` (of vertices) or `field` (heights over a rectangle).
        centre_m: (3,) of the box, the sphere or the field's rectangle.
        half_m: (3,) half sizes of the box or the field; of a sphere its radius, of a hull its bounds.
        deep: it counts as reaching down without end for the kinematic fit: nothing gets under it.
        vertices_m: (V, 3) of a hull; faces: (F, 3) of its triangles, counter-clockwise seen from outside.
        heights_m: (R, C) of a field over `centre_m[2] - half_m[2]`, rows along y, columns along x.
    """

    name: str
    shape: Shape
    centre_m: Array
    half_m: Array
    deep: bool = False
    vertices_m: Array | None = None
    faces: IntArray | None = None
    heights_m: Array | None = None

    @property
    def volume_m3(self) -> float:
        """Of the shape."""
        if self.shape == "sphere":
            return float(4 / 3 * np.pi * self.half_m[0] ** 3)
        if self.shape == "hull" and self.vertices_m is not None:
            return float(ConvexHull(self.vertices_m).volume)
        return float(8 * np.prod(self.half_m))


@dataclass(frozen=True, eq=False)
class Sheet:
    """A rectangle of sprung tiles, each of which moves up and down only.

    Attributes:
        centre_m: (3,) of its upper side at rest.
        size_m: along x and y; tiles: number along x and y.
        depth_m: how far a tile may sink.
        stiffness_Npm: of each tile against what carries it; tension_Npm: along x and y between neighbours.
        rim: the tiles at the edge are also held by it.
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
        """Stiffness (n, n) of the tiles' sinks, x outer, y inner."""
        (nx, ny), (tx, ty) = self.tiles, self.tension_Npm
        rows = [_chain(count, self.rim) for count in (nx, ny)]
        coupled = tx * np.kron(rows[0], np.eye(ny)) + ty * np.kron(np.eye(nx), rows[1])
        return np.asarray(coupled + self.stiffness_Npm * np.eye(nx * ny))


TILE_KG_PER_M2 = 4.0
"""Of a foam tile: it only has to be light against a person."""
RATED_KG = 70.0
"""Load that natural frequencies are given for."""
PATCH_M = 0.3
"""Edge of the load that a trampoline's stiffness is given for."""


def _chain(count: int, rim: bool) -> Array:
    """Stiffness (count, count) of unit springs between neighbours, and to a rim half a spacing away."""
    matrix = np.zeros((count, count))
    for i in range(count - 1):
        matrix[i : i + 2, i : i + 2] += [[1, -1], [-1, 1]]
    if rim:
        matrix[0, 0] += 2
        matrix[-1, -1] += 2
    return matrix


def solid(item: SceneItem, folder: str) -> tuple[Part, ...]:
    """The solid parts of a thing; `folder` holds the file of a mesh.

    Raises:
        InputError: its mesh can't be used.
    """
    values: dict[str, Any] = dict(item.parameters)
    if item.kind == "mesh":
        return _mesh(item, folder)
    if item.kind == "ramp":
        return (_wedge(values),)
    if item.kind == "mat":
        return ()
    made = _MAKERS[item.kind](values)
    return tuple(Part(*part) for part in made)


def sheet(item: SceneItem) -> Sheet | None:
    """The sprung sheet of a thing, if it has one."""
    values: dict[str, Any] = dict(item.parameters)
    if item.kind == "trampoline":
        return _membrane(values)
    if item.kind == "mat" or (item.kind == "bed" and values["stiffness_Npm3"] > 0):
        size = (values["length_m"], values["width_m"])
        nx, ny = (max(1, int(np.ceil(edge / values["tile_m"] - 1e-9))) for edge in size)
        area = size[0] * size[1] / (nx * ny)
        thick = values["mattress_m"] if item.kind == "bed" else values["height_m"]
        return Sheet(
            np.array([0.0, 0.0, values["height_m"]]),
            size,
            (nx, ny),
            0.95 * thick,
            values["stiffness_Npm3"] * area,
            (0.0, 0.0),
            False,
            values["damping_Nspm3"] / values["stiffness_Npm3"],
            TILE_KG_PER_M2 * area,
        )
    return None


def natural_frequency_hz(item: SceneItem) -> float:
    """Of a trampoline with `RATED_KG` in its middle."""
    return float(np.sqrt(float(str(item.parameters["stiffness_Npm"])) / RATED_KG) / (2 * np.pi))


def _membrane(values: dict[str, Any]) -> Sheet:
    """Tension from the stiffness in the middle: the discrete membrane T ∇²u = -p, solved once for T = 1."""
    size = (values["length_m"], values["width_m"])
    edge = min(size) / values["tiles"]
    nx, ny = (max(3, round(length / edge)) for length in size)
    dx, dy = size[0] / nx, size[1] / ny

    def made(tension: float) -> Sheet:
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

    unit = made(1.0)
    load = np.outer(_covered(nx, dx), _covered(ny, dy)).ravel()  # (n,) share of a unit load on each tile
    sink = float(load @ np.linalg.solve(unit.matrix(), load))
    return made(values["stiffness_Npm"] * sink)


def _covered(count: int, edge_m: float) -> Array:
    """Share (count,) of a load on the middle `PATCH_M` that each tile of a row bears."""
    edges = (np.arange(count + 1) - count / 2) * edge_m
    inside = np.clip(edges, -PATCH_M / 2, PATCH_M / 2)
    return np.asarray(np.diff(inside) / PATCH_M)


_Made = tuple[str, Shape, Array, Array, bool]


def _block(name: str, low: tuple[float, ...], high: tuple[float, ...], deep: bool = False) -> _Made:
    first, last = np.array(low, float), np.array(high, float)
    return name, "box", (first + last) / 2, (last - first) / 2, deep


def _box(v: dict[str, Any]) -> list[_Made]:
    x, y, z = v["size_m"]
    return [_standing("", x, y, z)]


def _standing(name: str, length: float, width: float, height: float) -> _Made:
    return name, "box", np.array([0.0, 0.0, height / 2]), np.array([length / 2, width / 2, height / 2]), True


def _beam(v: dict[str, Any]) -> list[_Made]:
    return [_standing("", v["length_m"], v["width_m"], v["height_m"])]


def _wall(v: dict[str, Any]) -> list[_Made]:
    return [_standing("", v["thickness_m"], v["length_m"], v["height_m"])]


def _legs(x: float, y: float, leg: float, height: float) -> list[_Made]:
    names = {(1, 1): "front_left", (1, -1): "front_right", (-1, 1): "rear_left", (-1, -1): "rear_right"}
    made = []
    for (sx, sy), name in names.items():
        cx, cy = sx * (x - leg) / 2, sy * (y - leg) / 2
        low, high = (cx - leg / 2, cy - leg / 2, 0.0), (cx + leg / 2, cy + leg / 2, height)
        made.append(_block(f"leg_{name}", low, high))
    return made


def _table(v: dict[str, Any]) -> list[_Made]:
    x, y, under = v["length_m"], v["width_m"], v["height_m"] - v["top_m"]
    top = _block("top", (-x / 2, -y / 2, under), (x / 2, y / 2, v["height_m"]))
    return [top, *_legs(x, y, v["leg_m"], under)]


def _chair(v: dict[str, Any]) -> list[_Made]:
    x, y, top, thick, leg = (
        v[key] for key in ("seat_depth_m", "seat_width_m", "seat_height_m", "seat_m", "leg_m")
    )
    made = [
        _block("seat", (-x / 2, -y / 2, top - thick), (x / 2, y / 2, top)),
        *_legs(x, y, leg, top - thick),
    ]
    if v["back"]:
        made.append(_block("back", (-x / 2 - thick, -y / 2, top), (-x / 2, y / 2, top + v["back_height_m"])))
    if v["arms"]:
        over = top + v["arm_height_m"]
        for sign, side in ((1, "left"), (-1, "right")):
            inner, outer = sorted((sign * y / 2, sign * (y / 2 + leg)))
            made.append(_block(f"arm_{side}", (-x / 2, inner, over - leg), (x / 2, outer, over)))
            made.append(_block(f"post_{side}", (x / 2 - leg, inner, top - thick), (x / 2, outer, over - leg)))
    return made


def _bed(v: dict[str, Any]) -> list[_Made]:
    if v["stiffness_Npm3"] <= 0:
        return [_standing("", v["length_m"], v["width_m"], v["height_m"])]
    base = max(v["height_m"] - v["mattress_m"], 0.01)
    return [_standing("", v["length_m"], v["width_m"], base)]


def _stairs(v: dict[str, Any]) -> list[_Made]:
    count, rise, run, y = v["steps"], v["rise_m"], v["run_m"], v["width_m"] / 2
    start = -count * run / 2
    return [
        _block(f"step_{i + 1}", (start + i * run, -y, 0.0), (start + (i + 1) * run, y, (i + 1) * rise), True)
        for i in range(count)
    ]


def _ball(v: dict[str, Any]) -> list[_Made]:
    radius = v["radius_m"]
    return [("", "sphere", np.array([0.0, 0.0, radius]), np.full(3, radius), False)]


def _frame(v: dict[str, Any]) -> list[_Made]:
    x, y, top, wide = v["length_m"] / 2, v["width_m"] / 2, v["height_m"], v["frame_m"]
    low, leg = top - 0.06, 0.06
    pads = [
        _block("pad_front", (x, -y - wide, low), (x + wide, y + wide, top)),
        _block("pad_rear", (-x - wide, -y - wide, low), (-x, y + wide, top)),
        _block("pad_left", (-x, y, low), (x, y + wide, top)),
        _block("pad_right", (-x, -y - wide, low), (x, -y, top)),
    ]
    return [*pads, *_legs(2 * (x + wide), 2 * (y + wide), leg, low)]


_MAKERS = {
    "box": _box,
    "beam": _beam,
    "table": _table,
    "chair": _chair,
    "bed": _bed,
    "stairs": _stairs,
    "wall": _wall,
    "ball": _ball,
    "trampoline": _frame,
}


def _hull(name: str, points_m: Array) -> Part:
    """The convex hull of points, with outward triangles and only the vertices that it needs."""
    hull = ConvexHull(points_m)
    vertices = np.unique(hull.simplices)
    place = np.full(len(points_m), -1)
    place[vertices] = np.arange(len(vertices))
    corners = points_m[hull.simplices]  # (F, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.einsum("fi,fi->f", normal, hull.equations[:, :3]) > 0
    faces = np.where(outward[:, None], hull.simplices, hull.simplices[:, ::-1])
    low, high = points_m.min(axis=0), points_m.max(axis=0)
    return Part(
        name,
        "hull",
        (low + high) / 2,
        (high - low) / 2,
        False,
        points_m[vertices],
        place[faces].astype(np.int64),
    )


def _wedge(v: dict[str, Any]) -> Part:
    x, y, z = v["length_m"] / 2, v["width_m"] / 2, v["height_m"]
    corners = [(sx * x, sy * y, 0.0) for sx in (-1, 1) for sy in (-1, 1)]
    return _hull("", np.array([*corners, (x, -y, z), (x, y, z)]))


def _mesh(item: SceneItem, folder: str) -> tuple[Part, ...]:
    found = meshes.load(item, folder)
    if isinstance(found, meshes.Field):
        return (Part("", "field", found.centre_m, found.half_m, True, heights_m=found.heights_m),)
    if len(found) == 1:
        return (_hull("", found[0]),)
    return tuple(_hull(f"part_{i + 1}", points) for i, points in enumerate(found))
