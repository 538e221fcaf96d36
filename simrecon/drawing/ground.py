"""The ground of a picture: level tiles around the person, and heights of planes and slabs."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.types import Array

# Colours are blue, green, red.
SKY = (240, 238, 236)
_TILES = ((216, 212, 208), (228, 225, 222))
_TILE_M, _COUNT_MAX = 0.5, 40
_MARGIN_M = 3.0
REACH_MAX_M = 20.0
"""Half the side of the ground that is drawn at once."""


def around(path_m: Array, place_m: Array) -> tuple[Array, float]:
    """Which part of the ground is drawn: middle (2,) and reach, m.

    Args:
        path_m: (T, 2) what it lies around, as far as that is within reach.
        place_m: (2,) where the person is, around which it lies if the path is longer.
    """
    low, high = path_m.min(axis=0), path_m.max(axis=0)
    reach = _MARGIN_M + float(np.linalg.norm(high - low)) / 2
    return ((low + high) / 2, reach) if reach <= REACH_MAX_M else (place_m, REACH_MAX_M)


def tiles(middle_m: Array, reach_m: float) -> tuple[Array, Array]:
    """Level tiles around a place (2,): corners (N, 4, 3) and colours (N, 3) that fade into the sky.

    There are at most 4 `_COUNT_MAX`²: the farther they reach, the larger they are.
    """
    tile = _TILE_M * 2.0 ** np.ceil(np.log2(max(reach_m / _TILE_M / _COUNT_MAX, 1.0)))
    middle = np.round(middle_m / tile)  # (2,) in tiles
    count = int(np.ceil(reach_m / tile))
    here = np.arange(-count, count)
    corner = np.stack(np.meshgrid(here, here), axis=-1).reshape(-1, 2) + middle  # (N, 2)
    flat = (corner[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]) * tile  # (N, 4, 2)
    corners = np.concatenate((flat, np.zeros((len(flat), 4, 1))), axis=-1)  # (N, 4, 3)
    far = np.linalg.norm(flat.mean(axis=1) - middle * tile, axis=-1) / reach_m  # (N,)
    colours = np.array(_TILES, float)[(corner.sum(axis=1) % 2).astype(int)]  # (N, 3)
    return corners, colours + (np.array(SKY) - colours) * np.clip(1.6 * far - 0.6, 0, 1)[:, None]


def height(model: mujoco.MjModel, data: mujoco.MjData, ground: int, xy_m: Array) -> Array:
    """Height of the upper side of a ground, a plane or a slab, at points (..., 2)."""
    normal = data.geom_xmat[ground].reshape(3, 3)[:, 2]
    slab = model.geom_type[ground] == mujoco.mjtGeom.mjGEOM_BOX
    top = data.geom_xpos[ground] + normal * (model.geom_size[ground, 2] if slab else 0.0)
    return np.asarray(top[2] - (xy_m - top[:2]) @ normal[:2] / normal[2])
