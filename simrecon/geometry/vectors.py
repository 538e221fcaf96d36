"""Directions of vectors."""

from __future__ import annotations

import numpy as np

from simrecon.types import Array


def unit(vectors: Array) -> Array:
    """Vectors (..., 3) of length one, in the same direction; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))
