"""How bright a face is drawn: flat shading by a light above, and by how far the face turns away."""

from __future__ import annotations

import numpy as np

from simrecon.geometry import camera as cameras
from simrecon.geometry import vectors
from simrecon.types import Array, Camera

_LIGHT_FROM = np.array([0.35, 0.45, 0.8])  # to the right, towards the camera, up


def shades(camera: Camera, normals: Array, facing: Array) -> Array:
    """Factors (F,) of the colours of faces.

    Args:
        camera: of one frame.
        normals: (F, 3) of length one.
        facing: (F,) cosine between normal and direction to the camera, at least zero.
    """
    lambert = np.maximum(normals @ _light(camera), 0.0)
    return np.asarray((0.5 + 0.58 * lambert) * (0.6 + 0.4 * np.sqrt(facing)))


def _light(camera: Camera) -> Array:
    """Unit vector to the light: above, and a little beside and before what is seen. (3,)."""
    rotation = cameras.extrinsics(camera)[0, :3, :3]
    right, towards = rotation[0], -rotation[2]
    return vectors.unit(
        _LIGHT_FROM[0] * right + _LIGHT_FROM[1] * towards + _LIGHT_FROM[2] * np.array([0.0, 0.0, 1.0])
    )
