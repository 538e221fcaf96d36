"""Shorthands for the arrays of the package."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Flags = NDArray[np.bool_]


def runs(flags: Flags) -> list[slice]:
    """Stretches of frames (T,) that are set, in their order."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False)).tolist()
    return [slice(begin, end) for begin, end in zip(edges[::2], edges[1::2], strict=True)]
