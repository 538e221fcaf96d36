"""Linear algebra on one thread."""

from __future__ import annotations

import numpy as np
from threadpoolctl import threadpool_info, threadpool_limits

from simrecon.system import blas


def threads() -> list[int]:
    """Of every library of linear algebra that is loaded."""
    assert np.linalg.norm(np.eye(2)) > 1
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_numpys_own_library_is_known_and_limited_meanwhile() -> None:
    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with blas.one_thread():
            assert set(threads()) == {1}
        assert threads() == before
    paths = [library["filepath"] for library in threadpool_info() if library["user_api"] == "blas"]
    assert any("numpy" in path for path in paths)
