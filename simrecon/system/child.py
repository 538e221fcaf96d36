"""Processes of our own: a second Python that runs a module of this package."""

from __future__ import annotations

import os
import sys


def environment() -> dict[str, str]:
    """Ours, with the places where Python finds its modules now, and one thread of linear algebra."""
    paths = os.pathsep.join(os.path.abspath(path) for path in sys.path)
    return os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
