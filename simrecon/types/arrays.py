"""Shorthands for the arrays of the package."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


IntArray = NDArray[np.int64]
