"""The ground of a picture: level tiles around the person's path, and heights of planes and slabs."""

from __future__ import annotations

import mujoco
import numpy as np

from simrecon.types import Array

# Colours are blue, green, red.
SKY = (240, 238, 236)
_TILES = ((216, 212, 208), (228, 225, 222))
_TILE_M = 0.5


def tiles(path_m: Array) -> tuple[Array, Array]:
    """Level tiles around a path (T, 2): corners (N, 4, 3) and colours (N, 3) that fade into the sky."""
    low, high = path_m.min(axis=0), path_m.max(axis=0)
    reach = 3.0 + float(np.linalg.norm(high - low)) / 2
    middle = np.round((low + high) / 2 / _TILE_M)  # (2,) in tiles
    count = int(np.ceil(reach / _TILE_M))
    here = np.arange(-count, count)
    corner = np.stack(np.meshgrid(here, here), axis=-1).reshape(-1, 2) + middle  # (N, 2)
    flat = (corner[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]) * _TILE_M  # (N, 4, 2)
    corners = np.concatenate((flat, np.zeros((len(flat), 4, 1))), axis=-1)  # (N, 4, 3)
    far = np.linalg.norm(flat.mean(axis=1) - middle * _TILE_M, axis=-1) / reach  # (N,)
    colours = np.array(_TILES, float)[(corner.sum(axis=1) % 2).astype(int)]  # (N, 3)
    return corners, colours + (np.array(SKY) - colours) * np.clip(1.6 * far - 0.6, 0, 1)[:, None]


def height(model: mujoco.MjModel, data: mujoco.MjData, ground: int, xy_m: Array) -> Array:
    """Height of the upper side of a ground, a plane or a slab, at points (..., 2)."""
    normal = data.geom_xmat[ground].reshape(3, 3)[:, 2]
    slab = model.geom_type[ground] == mujoco.mjtGeom.mjGEOM_BOX
    top = data.geom_xpos[ground] + normal * (model.geom_size[ground, 2] if slab else 0.0)
    return np.asarray(top[2] - (xy_m - top[:2]) @ normal[:2] / normal[2])
