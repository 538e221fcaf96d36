"""Helpers on arrays of the types."""

from __future__ import annotations

import numpy as np
import pytest

from simrecon.types import runs


@pytest.mark.parametrize(
    ("flags", "expected"),
    [
        ("", []),
        ("000", []),
        ("111", [(0, 3)]),
        ("0110100", [(1, 3), (4, 5)]),
        ("1001", [(0, 1), (3, 4)]),
    ],
)
def test_runs_are_the_stretches_that_are_set(flags: str, expected: list[tuple[int, int]]) -> None:
    """The first and the last frame may be of one."""
    found = runs(np.array([flag == "1" for flag in flags], dtype=bool))
    assert [(rows.start, rows.stop) for rows in found] == expected
